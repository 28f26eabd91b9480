"""``bisplat rooms``, and what ``bisplat compare`` does with its folder."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from tyro.conf import arg

from bisplat.commands.compared_quantities import print_scores
from bisplat.commands.simulate_command import Output
from scenes.files.errors import printable
from scenes.files.plain_text import say
from simulate.dataset.dataset_kinds import Outline, Setting


def rooms(
    output: Output,
    number: Annotated[int, arg(name="rooms", aliases=["-n"])] = 10,
    setting: Setting = "layout",
    seed: int = 0,
    spectra: int = 200,
    pieces: tuple[int, int] = (1, 12),
    shape: Outline = "rectangle",
    large: bool = False,
) -> None:
    """Simulate spectra in many random rooms.

    If the command is interrupted, the same command continues. bisplat compare scores methods in the last rooms.

    Args:
        output: the folder: a dataset folder for each room, and rooms.png with all floor plans.
        number: number of rooms.
        setting: what differs from room to room. same: the transmitter's positions; furniture: the furniture, too;
            layout: everything.
        seed: seed of the first room.
        spectra: number of spectra in each room.
        pieces: least and largest number of pieces of furniture, 0 to 12.
        shape: outline of the rooms; l: L-shaped; both: every second one is.
        large: make rooms of four to eight metres instead of two to four.
    """
    from simulate.generation.simulated_rooms import GALLERY, simulate_rooms

    made = simulate_rooms(output, number, setting, seed=seed, spectra=spectra, pieces=pieces, shape=shape, large=large)
    print(printable(f"{'1 room' if len(made) == 1 else f'{len(made)} rooms'}: {output}"))
    print(printable(f"floor plans: {output / GALLERY}"))


def compare_in_rooms(
    folder: Path,
    methods: tuple[str, ...],
    given: tuple[int, ...],
    test_rooms: int | None,
    test_spectra: int | None,
    seeds: int,
    budget: float,
    output: Path | None,
    json: bool,
) -> None:
    """Compare methods in the test rooms of a folder, and print the table."""
    from learn.rooms.compare_rooms import compare_rooms

    comparison = compare_rooms(
        folder,
        methods or None,
        given=given or None,
        test_rooms=test_rooms,
        test_spectra=test_spectra,
        seeds=seeds,
        budget=budget,
        output=output,
    )
    if output is not None:
        from learn.reports.score_report import write_room_comparison

        write_room_comparison(comparison, output)
    tested = "1 test room" if len(comparison.test) == 1 else f"{len(comparison.test)} test rooms"
    print_scores(f"comparison in {tested}, setting {comparison.setting}", comparison, json)
    if output is not None:
        say(printable(f"results: {output / 'results.json'}"))
