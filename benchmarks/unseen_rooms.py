"""How well do methods predict spectra in rooms that they never saw, from few known spectra?

python benchmarks/unseen_rooms.py --figure docs/generated/unseen-rooms.png --json > runs/unseen-rooms.json

The settings are those of GRaF: test rooms that differ from the training rooms in the transmitter's positions alone
("same"), in the furniture ("furniture"), or altogether ("layout"). Of each setting, ``bisplat rooms`` makes some random
rooms of 1 to 12 pieces of furniture, every second of the layouts L-shaped, at depth 2. The last rooms are test rooms.
Of each test room a fifth of the spectra is tested, and the same L others, drawn at random, are known to all methods
(``learn.rooms.compare_rooms``). ``attention`` is trained in the training rooms and sees pictures, the other methods
know the test room alone; ``helmholtz`` sees responses, too, ``helmholtz-pictures`` does not. The twin has a description
of the test room with errors of 3 cm, 2° and 20 %.

A row is a method and a setting, its columns are numbers L of known spectra. The figures are the mean and the median
SSIM over the test spectra of all test rooms together, of one draw.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, get_args

import tyro
from ledger.printing import print_figures
from matplotlib.figure import Figure

from learn.reports.method_styles import line_styles
from learn.rooms.compare_rooms import GIVEN, compare_rooms
from learn.rooms.room_methods import USUAL
from simulate.dataset.rooms_folder import Setting
from simulate.generation.simulated_rooms import simulate_rooms
from simulate.rays.core.propagation import Propagation

TRACED = Propagation(max_depth=2, rays=200_000)
SLOW, SLOW_GIVEN = ("helmholtz-pictures", "twin"), (25,)
"""Methods that are measured for one setting and these numbers of known spectra alone."""

Scores = dict[str, dict[str, float]]


def scores_of(
    folder: Path, setting: Setting, rooms: int, test_rooms: int, spectra: int, given: Sequence[int], budget: float
) -> Scores:
    """Scores by number of known spectra, of each method, and of each of the mean and the median."""
    traced = TRACED if rooms > 2 else Propagation(max_depth=0, diffraction=False, rays=1000)
    made = simulate_rooms(
        folder / setting,
        rooms,
        setting,
        shape="both" if setting == "layout" else "rectangle",
        spectra=spectra,
        propagation=traced,
    )
    rows = list(compare_rooms(made, USUAL, given=given, test_rooms=test_rooms, budget=budget))
    if setting == "layout" and rooms > 2:
        rows += list(compare_rooms(made, SLOW, given=SLOW_GIVEN, test_rooms=test_rooms))
    found: Scores = {}
    for key, words in (("ssim_mean", "mean SSIM"), ("ssim_median", "median SSIM")):
        for row in rows:
            name = f"{setting}, {row['label']}, {words}"
            found.setdefault(name, {})[f"{row['train_size']} known"] = round(row[key], 3)
    return found


def main(
    rooms: int = 6,
    test_rooms: int = 2,
    spectra: int = 150,
    budget: float = 1.5,
    folder: Path | None = None,
    figure: Path | None = None,
    smallest: bool = False,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Compare methods in unseen rooms.

    Args:
        rooms: number of rooms of each setting.
        test_rooms: number of test rooms among them.
        spectra: number of spectra in a room.
        budget: training time of the attention in each setting, minutes.
        folder: folder that keeps the rooms for the next run.
        figure: also draw the mean SSIM over the number of known spectra into this file; not with ``smallest``.
        smallest: only test the benchmark, in seconds; its figures mean nothing.
        json_output: print one JSON object.
    """
    given: Sequence[int] = GIVEN
    if smallest:
        rooms, test_rooms, spectra, budget, given = 2, 1, 8, 0.001, (5,)
    result: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as temporary:
        for setting in get_args(Setting):
            work = Path(temporary) if folder is None else folder
            result |= scores_of(work, setting, rooms, test_rooms, spectra, given, budget)
    if figure is not None and not smallest:
        draw(result, figure)
    result |= {"rooms of each setting": rooms, "of these test rooms": test_rooms, "minutes of training": budget}
    print_figures(result, json_output, smallest)


def draw(found: Scores, path: Path) -> None:
    """Draw the mean SSIM over the number of known spectra, a panel for each setting."""
    drawn = Figure(figsize=(10, 3.8), layout="constrained")
    panels = drawn.subplots(1, 3, sharey=True)
    styles = line_styles([*USUAL, *SLOW])
    for axis, setting in zip(panels, get_args(Setting), strict=True):
        for label in (*USUAL, *SLOW):
            row = found.get(f"{setting}, {label}, mean SSIM", {})
            if row:
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
