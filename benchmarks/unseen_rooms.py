"""How well do methods predict spectra in rooms that they never saw, from few known spectra?

python benchmarks/unseen_rooms.py --figure docs/generated/unseen-rooms.png --json > runs/unseen-rooms.json

The settings are those of GRaF: test rooms that differ from the training rooms in the transmitter's positions alone
("same"), in the furniture ("furniture"), or altogether ("layout"). Of each setting, ``bisplat rooms`` makes some random
rooms of 1 to 12 pieces of furniture, every second of the layouts L-shaped, at depth 2. The last rooms are test rooms.
Of each test room a fifth of the spectra is tested, and the same L others, drawn at random, are known to all methods
(``learn.rooms.compare_rooms``). ``attention`` is trained in the training rooms and sees pictures, the other methods
know the test room alone. ``helmholtz`` and ``mirror-images`` see responses, too. The twin is left out, since a fit
takes minutes.

A row is a method and a setting, its columns are numbers L of known spectra. The figures are the mean and the median
SSIM over the test spectra of all test rooms together, of one draw.
"""

from __future__ import annotations

import json
import tempfile
from pathlib import Path
from typing import Annotated, Any, NamedTuple, get_args

import tyro
from ledger.printing import print_figures
from matplotlib.figure import Figure

from learn.reports.method_styles import line_styles
from learn.rooms.compare_rooms import GIVEN, compare_rooms
from learn.rooms.room_methods import USUAL
from scenes.files.atomic import write_atomically
from simulate.dataset.room_settings import Setting
from simulate.generation.simulated_rooms import simulate_rooms
from simulate.rays.core.propagation import Propagation

TRACED = Propagation(max_depth=2, rays=200_000)
ROOMS: dict[Setting, int] = {"layout": 8, "furniture": 6, "same": 4}
"""Numbers of rooms, of which the last ``TESTED`` are test rooms."""

TESTED, SPECTRA = 2, 150
Scores = dict[str, dict[str, float]]


class Size(NamedTuple):
    """How much is measured: numbers of rooms, test rooms, spectra in a room and known ones, minutes of training."""

    rooms: dict[Setting, int]
    tested: int
    spectra: int
    given: tuple[int, ...]
    minutes: float


SMALLEST = Size(dict.fromkeys(get_args(Setting), 2), 1, 8, (5,), 0.001)


def scores_of(folder: Path, setting: Setting, size: Size) -> Scores:
    """Scores by number of known spectra, of each method, and of each of the mean and the median."""
    smallest = size is SMALLEST
    made = simulate_rooms(
        folder / setting,
        size.rooms[setting],
        setting,
        shape="both" if setting == "layout" else "rectangle",
        spectra=size.spectra,
        propagation=Propagation(max_depth=0, diffraction=False, rays=1000) if smallest else TRACED,
    )
    kept = folder / f"{setting}.json"
    if kept.is_file():
        return json.loads(kept.read_text())
    rows = list(compare_rooms(made, USUAL, given=size.given, test_rooms=size.tested, budget=size.minutes))
    found: Scores = {}
    for key, words in (("ssim_mean", "mean SSIM"), ("ssim_median", "median SSIM")):
        for row in rows:
            name = f"{setting}, {row['label']}, {words}"
            found.setdefault(name, {})[f"{row['train_size']} known"] = round(row[key], 3)
    write_atomically(kept, json.dumps(found).encode())
    return found


def main(
    settings: tuple[Setting, ...] = tuple(ROOMS),
    minutes: float = 1.0,
    folder: Path | None = None,
    figure: Path | None = None,
    smallest: bool = False,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Compare methods in unseen rooms.

    Args:
        settings: what differs between test rooms and training rooms.
        minutes: training time of the attention in each setting.
        folder: folder that keeps the rooms and the scores of each setting for the next run.
        figure: also draw the mean SSIM over the number of known spectra into this file; not with ``smallest``.
        smallest: only test the benchmark, in seconds; its figures mean nothing.
        json_output: print one JSON object.
    """
    size = SMALLEST if smallest else Size(ROOMS, TESTED, SPECTRA, GIVEN, minutes)
    result: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as temporary:
        for setting in settings:
            result |= scores_of(Path(temporary) if folder is None else folder, setting, size)
    if figure is not None and not smallest:
        draw(result, settings, figure)
    print_figures(result, json_output, smallest)


def draw(found: Scores, settings: tuple[Setting, ...], path: Path) -> None:
    """Draw the mean SSIM over the number of known spectra, a panel for each setting."""
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
    drawn.legend(*panels[-1].get_legend_handles_labels(), loc="outside upper center", ncols=4)
    drawn.savefig(path, dpi=120)


if __name__ == "__main__":
    tyro.cli(main)
