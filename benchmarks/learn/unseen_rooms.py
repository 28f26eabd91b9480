"""How well do methods predict spectra in rooms that they never saw, from few known spectra?

python -m benchmarks.learn.unseen_rooms --json

The settings are those of GRaF: test rooms that differ from the training rooms in the transmitter's positions alone
("same"), in the furniture ("furniture"), or altogether ("layout"). Of each setting, ``bisplat simulate --rooms``
makes some random rooms of 1 to 12 pieces of furniture, every second of the layouts L-shaped, at depth 2. The last
rooms are test rooms.
Of each test room a fifth of the spectra is tested, and the same L others, drawn at random, are known to all methods
(``bisplat.compare``). ``attention`` is trained in the training rooms and sees pictures, the other methods
know the test room alone. ``helmholtz`` and ``mirror-images`` see responses, too.

With ``--twin``, the twin is compared instead. It gets a description of the room that is 3 cm and 20 % wrong, and traces
to the depth of the data. Its fits take many minutes. So it is compared in the last room alone, with ten known spectra,
beside two methods on the same spectra.

A row is a setting and a method, its columns are numbers L of known spectra. The figures are the mean and the median
SSIM over the test spectra of all test rooms together, of one draw.

``attention`` learns little in a few rooms. The table of the documentation is of 36 training rooms in each setting:

python -m benchmarks.learn.unseen_rooms --rooms 40 --test-rooms 4 --minutes 20 --json > runs/unseen-rooms.json

With ``--folder``, what was measured is kept, and the same command continues. Delete the folder when the code has
changed.
"""

from __future__ import annotations

import shutil
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, NamedTuple, get_args

import numpy as np
import tyro
from matplotlib.figure import Figure

from benchmarks.ledger.printing import print_figures
from learn.comparison.cases import GIVEN
from learn.comparison.compare import compare
from learn.methods.method_table import methods_of, usual_names
from learn.quantities.known import Known
from learn.quantities.quantity import Prediction
from learn.reports.method_styles import line_styles
from learn.training.prediction import predict
from learn.twin.twin_model import Twin
from scenes.scene.tolerances import Tolerances
from scenes.scene.unknowns import unknowns, vary
from scenes.storage.scene_writing import write_scene
from scenes.storage.scene_yaml import load_scene
from simulate.dataset.dataset_kinds import Setting
from simulate.dataset.rooms_folder import Rooms
from simulate.engines.rays_engine import Rays
from simulate.generation.simulated_rooms import GALLERY, simulate_rooms
from simulate.rays.core.propagation import Propagation

TRACED = Propagation(max_depth=2, rays=200_000)
ROOMS: dict[Setting, int] = {"layout": 8, "furniture": 6, "same": 4}
"""Numbers of rooms, of which the last ones are test rooms."""

SPECTRA = 150
BESIDE_TWIN = "inverse-distance", "helmholtz", "twin"
WRONG_BY = Tolerances(position=0.03, rotation=2.0, objects=0.03, materials=0.2)
"""Standard deviations of the errors in the description of a room that the twin gets."""

LAST = "last room alone, "
"""Beginning of the names of rows that are of one test room."""

USUAL = usual_names("room", methods_of("room"))

Rows = list[dict[str, Any]]
Scores = dict[str, dict[str, float]]


class TwinInRoom:
    """``twin``, with a description of the room that has errors of ``WRONG_BY``.

    Its rays follow what those of the dataset followed, so that nothing but the description is wrong.
    """

    def fit(self, room: Known) -> None:
        dataset, region = room.dataset, np.stack([room.positions.min(axis=0), room.positions.max(axis=0)])
        scene = load_scene(dataset.folder / "scene" / "scene.yaml")
        which = unknowns(scene, WRONG_BY)
        errors = np.random.default_rng(room.seed).normal(size=len(which)) * [each.tolerance for each in which]
        with tempfile.TemporaryDirectory() as folder:
            described = write_scene(vary(scene, which, errors), Path(folder))
            self.model = Twin(region, dataset.beamformer, dataset.wavelength, scene=str(described))
        self.model.propagation = replace(Rays.of(dataset.metadata).propagation, sionna=False, diffuse=False)
        self.model.fit(dataset, np.sort(room.rows))

    def predict(self, positions: np.ndarray) -> Prediction:
        return Prediction(predict(self.model, positions).spectra)


class Part(NamedTuple):
    """What is measured together: a method, numbers of known spectra, number of test rooms, beginning of its rows."""

    method: str
    given: tuple[int, ...]
    tested: int
    label: str = ""


OF_TWIN = tuple(Part(method, (10,), 1, LAST) for method in BESIDE_TWIN)


class Size(NamedTuple):
    """How much is measured: numbers of rooms, spectra in a room, the parts, and minutes of training."""

    rooms: dict[Setting, int]
    spectra: int
    parts: tuple[Part, ...]
    minutes: float


SMALLEST = Size(
    dict.fromkeys(get_args(Setting), 2),
    8,
    (*(Part(method, (5,), 1) for method in USUAL), Part("twin", (5,), 1, LAST)),
    0.001,
)


def rooms_of(folder: Path, setting: Setting, size: Size) -> Rooms:
    """The rooms of a setting."""
    smallest = size is SMALLEST
    return simulate_rooms(
        folder / setting,
        size.rooms[setting],
        setting,
        shape="both" if setting == "layout" else "rectangle",
        spectra=size.spectra,
        propagation=Propagation(max_depth=0, diffraction=False, rays=1000) if smallest else TRACED,
    )


def measured(folder: Path, rooms: Rooms, part: Part, minutes: float) -> Rows:
    """The rows of a part in the rooms of a setting; those that the folder has are not measured again."""
    output = folder / f"compared-{rooms.setting}-{part.tested}"
    compared = compare(
        rooms,
        {part.method: TwinInRoom if part.method == "twin" else part.method},
        sizes=part.given,
        test_rooms=part.tested,
        budget=minutes,
        output=output,
    )
    return [row for row in compared.rows if row["label"] == part.method and row["train_size"] in part.given]


def named(setting: Setting, label: str, rows: Rows) -> Scores:
    """Scores by number of known spectra, of each of the mean and the median."""
    found: Scores = {}
    for row in rows:
        for key, words in (("ssim_mean", "mean SSIM"), ("ssim_median", "median SSIM")):
            scores = found.setdefault(f"{setting}, {label}{row['label']}, {words}", {})
            scores[f"{row['train_size']} known"] = round(row[key], 3)
    return found


def main(
    settings: tuple[Setting, ...] = tuple(ROOMS),
    rooms: int | None = None,
    test_rooms: int = 2,
    minutes: float = 1.0,
    folder: Path | None = None,
    twin: bool = False,
    figure: Path | None = None,
    smallest: bool = False,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Compare methods in unseen rooms."""
    numbers = ROOMS if rooms is None else dict.fromkeys(settings, rooms)
    parts = OF_TWIN if twin else tuple(Part(method, GIVEN, test_rooms) for method in USUAL)
    size = SMALLEST if smallest else Size(numbers, SPECTRA, parts, minutes)
    result: Scores = {}
    with tempfile.TemporaryDirectory() as temporary:
        work = Path(temporary) if folder is None else folder
        made = {setting: rooms_of(work, setting, size) for setting in settings}
        for part in size.parts:
            for setting, these in made.items():
                for name, scores in named(setting, part.label, measured(work, these, part, size.minutes)).items():
                    result.setdefault(name, {}).update(scores)
        result = dict(sorted(result.items(), key=lambda row: settings.index(row[0].split(",")[0])))
        if figure is not None and not smallest and not twin:
            draw(result, settings, figure)
            shutil.copyfile(work / settings[0] / GALLERY, figure.with_stem(f"{figure.stem}-plans"))
    print_figures(result, json_output, smallest)


def draw(found: Scores, settings: tuple[Setting, ...], path: Path) -> None:
    """Draw the mean SSIM in all test rooms over the number of known spectra, a panel for each setting."""
    drawn = Figure(figsize=(2 + 3 * len(settings), 3.8), layout="constrained")
    panels = drawn.subplots(1, len(settings), sharey=True, squeeze=False)[0]
    styles = line_styles(USUAL)
    for axis, setting in zip(panels, settings, strict=True):
        for label in USUAL:
            row = found[f"{setting}, {label}, mean SSIM"]
            axis.plot([int(size.split()[0]) for size in row], list(row.values()), label=label, **styles[label])
        axis.set(title=setting, xscale="log", xlabel="known spectra of the test room")
        axis.set_xticks(GIVEN, [str(each) for each in GIVEN])
        axis.minorticks_off()
        axis.grid(alpha=0.3)
    panels[0].set_ylabel("mean SSIM")
    drawn.legend(*panels[-1].get_legend_handles_labels(), loc="outside upper center", ncols=len(USUAL))
    drawn.savefig(path, dpi=120)


if __name__ == "__main__":
    tyro.cli(main)
