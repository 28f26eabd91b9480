"""Can measured spectra correct a wrong description of a place, and what is the result worth?

python -m benchmarks.uses.twin --figure docs/generated/twin.png --json > runs/twin.json

The truth is the closet in full wave (the field in tests/data), and the lab by the same rays that the twin traces. The
known spectra have an SNR of 20 dB. The description gets normal errors of three sizes (of one size in the lab): in the
materials, in the places of objects, and in the position and orientation of the gateway.

The figures are the median SSIM at 100 other positions and the median correlation of their responses, as means over the
draws. They are measured for several numbers of known spectra, with responses and with pictures alone. The methods are
``twin``, ``helmholtz`` and inverse-distance weighting. With 0 known spectra, ``twin`` is ray tracing of the wrong
description. Further figures say how far the corrected scene is from the truth, in stated standard deviations. In the
rows ``true description``, nothing is wrong, and the twin corrects only the gains of chains.

The figures of each draw are kept in a folder for the next run. Delete the folder when the code has changed.
"""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
import tyro
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from benchmarks.ledger.printing import print_figures
from learn.data.metrics import ssim
from learn.data.neighbours import inverse_distance
from learn.models.base import SpectrumModel
from learn.models.kriging.helmholtz import HelmholtzField
from learn.training.prediction import predict
from learn.twin.calibration import Calibration
from learn.twin.twin_model import Twin
from scenes.files.atomic import write_atomically
from scenes.scene.description import Scene
from scenes.scene.tolerances import Tolerances
from scenes.scene.unknowns import OF_POSE, Unknown, unknowns, vary
from scenes.storage.scene_writing import write_scene
from scenes.storage.scene_yaml import load_scene
from simulate.dataset.dataset import Dataset
from simulate.generation.simulation import simulate
from simulate.spectra.measurement import Measurement

LEVELS = {
    "small": Tolerances(position=0.01, rotation=1.0, objects=0.01, materials=0.1),
    "middle": Tolerances(position=0.03, rotation=2.0, objects=0.03, materials=0.2),
    "large": Tolerances(position=0.06, rotation=4.0, objects=0.06, materials=0.4),
}


class Study(NamedTuple):
    """What is measured in a built-in scene: levels, kinds of spectra, draws, numbers of known and of tested spectra.

    ``field`` is the stored field of full wave that is the truth; without one, rays are. ``most``: a larger number of
    known spectra, for ``helmholtz`` without a description. ``label`` begins the names of the rows.
    """

    place: str = "closet"
    label: str = ""
    field: Path | None = Path("tests/data/closet")
    levels: tuple[str, ...] = tuple(LEVELS)
    kinds: tuple[str, ...] = ("responses", "pictures")
    draws: int = 3
    sizes: tuple[int, ...] = (0, 10, 40, 160, 640)
    most: int = 1000
    tested: int = 100


CLOSET = Study()
LAB = Study("lab", "lab, ", None, levels=("middle",), sizes=(0, 40))
SMALLEST = Study(levels=("middle",), draws=1, sizes=(0, 3), most=4, tested=2)
REGION = np.zeros((2, 3))
Figures = dict[str, float]


@dataclass(frozen=True)
class Truth:
    """Noisy spectra to learn from, and others without noise to test on."""

    measured: Dataset
    tested: Dataset

    def seen(self, kind: str) -> Dataset:
        """The measured spectra with or without their responses."""
        return self.measured if kind == "responses" else self.measured.with_values(response=None)

    def scores(self, model: SpectrumModel, name: str) -> Figures:
        """SSIM, and correlation of the responses if the model predicts any."""
        found = predict(model, self.tested.positions)
        figures = {f"SSIM, {name}": float(np.median(ssim(found.spectra, self.tested.spectra)))}
        if found.responses is not None and "response" in self.tested.values:
            true = self.tested.responses
            product_ = np.abs((found.responses.conj() * true).sum(axis=1))
            size = np.linalg.norm(found.responses, axis=1) * np.linalg.norm(true, axis=1)
            figures[f"correlation, {name}"] = float(np.median(product_ / size))
        return figures


def truth_of(study: Study, work: Path) -> Truth:
    """Simulated spectra of a study; they are written to a folder first."""
    made: Any = {"engine": "fullwave", "field": study.field} if study.field else {}
    noise = Measurement(snr_db=20)
    return Truth(
        simulate(study.place, work / "noisy", study.most, measurement=noise, seed=1, **made),
        simulate(study.place, work / "clean", study.tested, seed=2, **made),
    )


def wrong(scene: Scene, tolerances: Tolerances, draw: int) -> Scene:
    """A scene with normally distributed errors."""
    return vary(scene, *errors(scene, tolerances, draw))


def errors(scene: Scene, tolerances: Tolerances, draw: int) -> tuple[list[Unknown], Float[np.ndarray, " n"]]:
    """The scene's unknowns, and the error of each."""
    which = unknowns(scene, tolerances)
    return which, np.random.default_rng(draw).normal(size=len(which)) * [each.tolerance for each in which]


def left(found: Calibration, which: list[Unknown], wrong_by: Float[np.ndarray, " n"]) -> Figures:
    """Errors that are left after the correction, in stated standard deviations, root mean square."""
    errors_of = dict(zip(which, wrong_by, strict=True))
    ratios: dict[bool, list[float]] = {True: [], False: []}
    for unknown, value, deviation in zip(found.which, found.values, found.deviations, strict=True):
        ratios[unknown.kind in OF_POSE].append(float(value + errors_of[unknown]) / float(deviation))
    names = {True: "pose off, deviations", False: "rest off, deviations"}
    return {names[of_pose]: float(np.sqrt(np.mean(np.square(each)))) for of_pose, each in ratios.items()}


def without_scene(truth: Truth, kind: str, size: int) -> Figures:
    """Scores of the methods that know nothing of the place."""
    data, known = truth.seen(kind), np.arange(size)
    spectra = inverse_distance(data.positions[known], data.spectra[known], truth.tested.positions)
    model = HelmholtzField(REGION, data.beamformer, data.wavelength)
    model.fit(data, known)
    figures = {"SSIM, inverse-distance": float(np.median(ssim(spectra, truth.tested.spectra)))}
    return figures | truth.scores(model, "helmholtz")


def of_twin(truth: Truth, scene: Scene, tolerances: Tolerances, draw: int, kind: str, size: int) -> Figures:
    """Scores of the twin, and its error of the gateway's position.

    The errors of the pose, and of all else, are also given in posterior standard deviations, root mean square.
    """
    data = truth.seen(kind)
    with tempfile.TemporaryDirectory() as folder:
        described = write_scene(wrong(scene, tolerances, draw), Path(folder) / "described")
        options: Any = {name: getattr(tolerances, name) for name in ("position", "rotation", "objects", "materials")}
        twin = Twin(REGION + scene.transmitter.region, data.beamformer, data.wavelength, str(described), **options)
        if size == 0:
            return truth.scores(twin, "twin")
        twin.fit(data, np.arange(size))
    assert twin.calibration is not None
    found, true = twin.corrected.gateway, scene.gateway
    turned = Rotation.from_quat(found.orientation) * Rotation.from_quat(true.orientation).inv()
    return {
        **truth.scores(twin, "twin"),
        "position off, mm": 1e3 * float(np.linalg.norm(np.subtract(found.position, true.position))),
        "orientation off, °": float(np.degrees(turned.magnitude())),
        **left(twin.calibration, *errors(scene, tolerances, draw)),
    }


def of_true_scene(truth: Truth, scene: Scene, kind: str, size: int) -> Figures:
    """Scores of a twin whose description is right and is not changed."""
    data = truth.seen(kind)
    with tempfile.TemporaryDirectory() as folder:
        described = write_scene(scene, Path(folder) / "described")
        region = REGION + scene.transmitter.region
        twin = Twin(region, data.beamformer, data.wavelength, str(described))
        if size:
            twin.refit(data, np.arange(size))
        return truth.scores(twin, "twin")


def kept(path: Path, compute: Any) -> Figures:
    """Figures from a file; if there is no such file, they are computed and written to it."""
    if not path.exists():
        write_atomically(path, json.dumps(compute()).encode())
    return json.loads(path.read_text())


def rows(truth: Truth, scene: Scene, folder: Path, study: Study) -> Iterator[tuple[str, Figures]]:
    """A row for each level, kind of spectra and number of them: means over the draws."""
    plain: dict[tuple[str, int], Figures] = {}
    for kind, size in product(study.kinds, (*study.sizes[1:], study.most)):
        plain[kind, size] = kept(folder / f"{kind}-{size}.json", lambda k=kind, n=size: without_scene(truth, k, n))
    for kind in study.kinds:
        yield f"{study.label}no description, {kind}, {study.most}", plain[kind, study.most]
    for kind, size in product(study.kinds, study.sizes if study.field else ()):
        if size == 0 and kind == "pictures":
            continue
        path = folder / f"true-{kind}-{size}.json"
        right = kept(path, lambda k=kind, n=size: of_true_scene(truth, scene, k, n))
        yield f"{study.label}true description, {kind}, {size}", right | plain.get((kind, size), {})
    for level, kind, size in product(study.levels, study.kinds, study.sizes):
        if size == 0 and kind == "pictures":
            continue
        found = [
            kept(
                folder / f"{level}-{kind}-{size}-{draw}.json",
                lambda t=LEVELS[level], d=draw, k=kind, n=size: of_twin(truth, scene, t, d, k, n),
            )
            for draw in range(study.draws)
        ]
        mean = {name: float(np.mean([each[name] for each in found])) for name in found[0]}
        yield f"{study.label}{level}, {kind}, {size}", mean | plain.get((kind, size), {})


def draw(found: dict[str, Figures], study: Study, path: Path) -> None:
    """The median SSIM over the number of known spectra, from responses and from pictures."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, len(study.kinds), figsize=(10, 4.5), sharey=True, layout="constrained")
    descriptions = {"true description": "twin, nothing wrong"} | {each: f"twin, {each} errors" for each in study.levels}
    for axis, kind in zip(axes, study.kinds, strict=True):

        def score(description: str, size: int, method: str, kind: str = kind) -> float:
            return found[f"{study.label}{description}, {kind if size else 'responses'}, {size}"][f"SSIM, {method}"]

        for description, label in descriptions.items():
            scores = [score(description, size, "twin") for size in study.sizes]
            axis.plot(scores, "k:" if description == "true description" else "o-", label=label)
        for method in ("helmholtz", "inverse-distance"):
            known = range(1, len(study.sizes))
            scores = [score(study.levels[0], study.sizes[each], method) for each in known]
            axis.plot(known, scores, "s--", label=method)
        axis.set(xlabel="known spectra", title=f"from {kind}")
        axis.set_xticks(range(len(study.sizes)), [str(size) for size in study.sizes])
        axis.grid(True, alpha=0.3)
    axes[0].set_ylabel("median SSIM of 100 other spectra")
    axes[0].legend()
    figure.savefig(path, dpi=120)
    plt.close(figure)


def main(
    folder: Path = Path("runs/twin"),
    figure: Path | None = None,
    smallest: bool = False,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Score the twin."""
    found: dict[str, Figures] = {}
    with tempfile.TemporaryDirectory() as temporary:
        for study in (SMALLEST,) if smallest else (CLOSET, LAB):
            scene, work = load_scene(study.place), Path(temporary) / study.place
            if smallest:
                scene = replace(scene, objects=scene.objects[:2])
            results_in = (work if smallest else folder) / study.place
            results_in.mkdir(parents=True, exist_ok=True)
            for name, row in rows(truth_of(study, work), scene, results_in, study):
                found[name] = {key: round(value, 4) for key, value in row.items()}
    if figure is not None and not smallest:
        draw(found, CLOSET, figure)
    print_figures(found, json_output, smallest)


if __name__ == "__main__":
    tyro.cli(main)
