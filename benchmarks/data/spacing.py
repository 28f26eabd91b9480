"""How many spectra does a room need? The score over the density of the known positions, for several rooms.

python -m benchmarks.data.spacing data/rfid-s23-160 --curve learn/data/expected_score.json \
    --figure docs/generated/expected-score.png --json > runs/spacing.json

In each room, known and test positions are drawn uniformly: in the volume, and at one height; in the whole transmitter
region, and in its middle with half the extents, which reaches high densities with few spectra. The score is the median
SSIM of ``helmholtz`` at the test positions. The rooms are the built-in places by rays, with 4 × 4 elements. ``--curve``
writes their scores to the file that ``bisplat check`` and others read.

The rows "all rooms" are the curve: the lowest, the median and the highest of the rooms. The other rows tell how far it
can be trusted: the score of a room beside the curve of all *other* rooms; of an L-shaped office and of the closet in
full wave (the field in tests/data), which are not in the curve; of the middle of a region beside that of the whole at
the same density; and of the measured sample, a path, to which the curve does not apply. The scores of each room are
kept in a folder for the next call.
"""

from __future__ import annotations

import datetime
import json
import tempfile
from collections.abc import Callable
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
import tyro
from jaxtyping import Float
from tyro.conf import Positional

from benchmarks.learn.interval_coverage import in_l_shape, l_shaped_room
from benchmarks.ledger.printing import print_figures
from benchmarks.uses.plan import dataset_at, fitted
from learn.data.expected_score import Expected, ScoreCurve, Shape, Spacing, scores_in
from learn.data.metrics import ssim
from learn.data.splits import split
from learn.training.prediction import predict
from scenes.places.built_in import BUILT_IN
from scenes.scene.description import SPEED_OF_LIGHT, Scene
from scenes.storage.scene_yaml import load_scene
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_folder import read_dataset
from simulate.engines.field_folder import FIELD
from simulate.fullwave.stored_field import StoredField, read_stored_field
from simulate.positions.placement import free_positions
from simulate.rays.core.propagation import Propagation
from simulate.rays.tracer import Tracer

DENSITIES = (1.0, 2.0, 4.0, 8.0, 16.0, 32.0)
"""Known positions per cubic or square wavelength."""

SIZES = {"whole": (18, 430), "middle": (40, 830)}
"""Least and largest number of known spectra in a region and in its middle."""

TESTED = 150

SHAPES: tuple[Shape, ...] = ("volume", "plane")

FULL_WAVE = "closet, full wave"

CORNER = 2.1
"""Metres along x and y of the L-shaped office's corner, between its two wings."""

Points = Float[np.ndarray, "n 3"]


class Point(NamedTuple):
    """A score, and where it comes from."""

    shape: Shape  # whether the positions fill a volume or a plane
    part: str  # whole or middle: of the transmitter region
    density: float  # known positions per cubic or square wavelength
    known: int  # number of known positions
    score: float  # median SSIM at the test positions


def regions(whole: Float[np.ndarray, "2 3"]) -> dict[tuple[Shape, str], Float[np.ndarray, "2 3"]]:
    """A region and its middle with half the extents, in the volume and at one height."""
    found: dict[tuple[Shape, str], Float[np.ndarray, "2 3"]] = {}
    middle, extents = whole.mean(axis=0), np.ptp(whole, axis=0)
    for part, share in (("whole", 0.5), ("middle", 0.25)):
        for shape, height in (("volume", 1), ("plane", 0)):
            half = share * extents * [1, 1, height]
            found[shape, part] = np.stack([middle - half, middle + half])  # type: ignore[index]
    return found


def first(dataset: Dataset, count: int) -> Dataset:
    """The first spectra of a dataset."""
    values = {name: each[:count] for name, each in dataset.values.items()}
    return replace(dataset, names=dataset.names[:count], values=values, places=dataset.positions[:count])


def scores(known: Dataset, test: Dataset, sizes: list[int]) -> list[float]:
    """Median SSIM of test spectra, predicted from several numbers of known ones."""
    found = []
    for size in sizes:
        prediction = predict(fitted(first(known, size)), test.positions).spectra
        found.append(round(float(np.median(ssim(prediction, test.spectra))), 4))
    return found


def points(scene: Scene, field: Tracer | StoredField, smallest: bool) -> list[Point]:
    """The scores of a room: in its region and in the middle of it, in the volume and at one height."""
    found = []
    for (shape, part), region in regions(scene.transmitter.region).items():
        extents = np.ptp(region, axis=0) * scene.frequency / SPEED_OF_LIGHT
        size = float(np.prod(extents[extents > 0]))
        least, most = (1, 20) if smallest else SIZES[part]
        sizes = {density: round(density * size) for density in DENSITIES}
        sizes = {density: count for density, count in sizes.items() if least <= count <= most}
        if smallest:
            sizes = {1.0: 12} if part == "whole" else {2.0: 12}
        if not sizes:
            continue
        known, test = (
            dataset_at(free_positions(scene, region, count, np.random.default_rng(seed)), scene, field)
            for seed, count in enumerate((max(sizes.values()), 4 if smallest else TESTED))
        )
        found += [
            Point(shape, part, density, count, score)
            for (density, count), score in zip(sizes.items(), scores(known, test, [*sizes.values()]), strict=True)
        ]
    return found


def l_shaped(smallest: bool) -> list[tuple[int, float, float]]:
    """Known positions, density and score in an L-shaped office, and in its corner."""
    scene = l_shaped_room()
    field = Tracer(scene, Propagation(max_depth=0) if smallest else Propagation())
    found = []
    for corner, sizes in ((False, [300, 800]), (True, [100, 400])):
        sizes = [12] if smallest else sizes
        tested = 4 if smallest else TESTED
        drawn = np.random.default_rng(0).uniform(*scene.transmitter.region, (5000, 3))
        drawn = drawn[in_l_shape(drawn) & ~(corner & (drawn[:, :2] > CORNER).any(axis=1))]
        known = dataset_at(drawn[tested:][: max(sizes)], scene, field)
        for size, score in zip(sizes, scores(known, dataset_at(drawn[:tested], scene, field), sizes), strict=True):
            spacing = Spacing.between(known.positions[:size], known.wavelength)
            assert spacing is not None
            found.append((size, spacing.density, score))
    return found


def kept(file: Path, measure: Callable[[], Any]) -> Any:
    """What an earlier call measured and kept in a file, or what is measured now."""
    if not file.is_file():
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(json.dumps(measure()))
    return json.loads(file.read_text())


def by_density(room: list[Point], shape: Shape, part: str | None = None) -> dict[float, float]:
    """The scores of a room in a shape by density. Where both were measured, that of the whole region counts."""
    chosen = sorted((point for point in room if point.shape == shape), key=lambda point: point.part == "whole")
    return {point.density: point.score for point in chosen if part in (None, point.part)}


def beside(expected: Expected, known: int | None, score: float) -> dict[str, Any]:
    """A score, and the curve's."""
    low, middle, high = (round(each, 3) for each in expected)
    within = "yes" if expected.low <= score <= expected.high else "no"
    return {"low": low, "middle": middle, "high": high, "known": known, "found": round(score, 3), "within": within}


def rows(rooms: dict[str, list[Point]], shape: Shape) -> dict[str, Any]:
    """The curve, each room beside the curve of the others, and the middle of regions beside the whole."""
    unit = {"volume": "per λ³", "plane": "per λ²"}[shape]
    of_rooms = {name: by_density(room, shape) for name, room in rooms.items()}
    curve = ScoreCurve.over(of_rooms)
    found: dict[str, Any] = {
        f"all rooms, {density:g} {unit}": dict(
            zip(("low", "middle", "high"), (round(each, 3) for each in curve.at(density)), strict=True)
        )
        for density in curve.density
    }
    for name, scores_of in of_rooms.items():
        others = ScoreCurve.over({other: each for other, each in of_rooms.items() if other != name})
        counts = {point.density: point.known for point in rooms[name] if point.shape == shape}
        found |= {
            f"{name}, {density:g} {unit}": beside(others.at(density), counts[density], score)
            for density, score in scores_of.items()
        }
    within = [row["within"] for row in found.values() if "within" in row]
    differences = [
        by_density(room, shape, "middle")[density] - score
        for room in rooms.values()
        for density, score in by_density(room, shape, "whole").items()
        if density in by_density(room, shape, "middle")
    ]
    found[f"left-out rooms within the range of the others, {unit}"] = {
        "found": f"{within.count('yes')} of {len(within)}"
    }
    if differences:
        low, middle, high = np.quantile(differences, [0, 0.5, 1]).round(3).tolist()
        found[f"middle of the region minus whole, {unit}"] = {"low": low, "middle": middle, "high": high}
    return found


def measured_path(folder: Path) -> dict[str, Any]:
    """The score of the measured sample, and its spacing."""
    from learn.models.kriging.helmholtz import HelmholtzField

    dataset = read_dataset(folder)
    parts = split(dataset, "files", 0)
    model = HelmholtzField(np.zeros((2, 3)), dataset.beamformer, dataset.wavelength)
    model.fit(dataset, parts.known)
    test = parts.test
    score = float(np.median(ssim(predict(model, dataset.positions[test]).spectra, dataset.spectra[test])))
    return {"known": len(parts.known), "found": round(score, 3)}


def write_curve(rooms: dict[str, list[Point]], file: Path) -> None:
    """Write the scores of the rooms to the file that the product reads."""
    content = {
        "made_by": f"python -m benchmarks.data.spacing, bisplat-wrf {version('bisplat-wrf')}",
        "date": datetime.date.today().isoformat(),
        "score": "median SSIM of helmholtz, by known positions per cubic wavelength (volume) or square one (plane)",
        "rooms": {
            name: {shape: dict(sorted(by_density(room, shape).items())) for shape in SHAPES}
            for name, room in rooms.items()
        },
    }
    file.write_text(json.dumps(content, indent=1) + "\n")


def draw(curve: Path, path: Path) -> None:
    """The curves and the rooms' scores over the density, an axis for each shape."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 3.6), layout="constrained")
    axes = figure.subplots(1, 2, sharey=True)
    for axis, shape in zip(axes, SHAPES, strict=True):
        rooms, unit = scores_in(curve, shape), {"volume": "cubic", "plane": "square"}[shape]
        line = ScoreCurve.over(rooms)
        axis.fill_between(line.density, line.low, line.high, color="0.85", label="range of the rooms")
        axis.plot(line.density, line.middle, color="black", lw=2, label="median")
        for (room, scores_of), marker in zip(rooms.items(), "osv^DPX*", strict=False):
            axis.plot(list(scores_of), list(scores_of.values()), marker, ms=5, label=room)
        axis.set(xscale="log", xlabel=f"known positions per {unit} wavelength", title=f"in a {shape}")
        ticks = line.density
        axis.set_xticks(ticks, [f"{each:g}" for each in ticks])
        axis.minorticks_off()
        axis.grid(alpha=0.3)
    axes[0].set_ylabel("median SSIM of helmholtz")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside right center", fontsize="small")
    figure.savefig(path, dpi=120)


def main(
    measured: Positional[Path],
    folder: Path = Path("runs/spacing"),
    curve: Path | None = None,
    figure: Path | None = None,
    field: Path = Path("tests/data/closet"),
    smallest: bool = False,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Measure the score over the density of the known positions."""
    propagation = Propagation(max_depth=0) if smallest else Propagation()
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary) if smallest else folder

        def room(name: str, made: Callable[[Scene], Tracer | StoredField]) -> list[Point]:
            scene = load_scene(name.partition(",")[0])
            found = kept(folder / f"{name}.json", lambda: points(scene, made(scene), smallest))
            return [Point(*each) for each in found]

        places = list(BUILT_IN)[:2] if smallest else list(BUILT_IN)
        rooms = {name: room(name, lambda scene: Tracer(scene, propagation)) for name in places}
        full_wave = room(FULL_WAVE, lambda _: read_stored_field(field / FIELD))
        office = kept(folder / "L-shaped.json", lambda: l_shaped(smallest))
        written = Path(temporary) / "expected_score.json" if curve is None or smallest else curve
        write_curve(rooms, written)
        figures: dict[str, Any] = {}
        for shape, unit in (("volume", "per λ³"), ("plane", "per λ²")):
            figures |= rows(rooms, shape)
            whole = ScoreCurve.over({name: by_density(each, shape) for name, each in rooms.items()})
            figures |= {
                f"{FULL_WAVE}, {point.density:g} {unit}": beside(whole.at(point.density), point.known, point.score)
                for point in full_wave
                if point.shape == shape and point.density in whole.density and point.part == "whole"
            }
            if shape == "volume":
                figures |= {
                    f"L-shaped office, {density:.2g} {unit}": beside(whole.at(density), known, score)
                    for known, density, score in office
                }
        figures["measured sample, along a path"] = measured_path(measured)
        if figure is not None:
            draw(written, figure)
    print_figures(figures, json_output, smallest)


if __name__ == "__main__":
    tyro.cli(main)
