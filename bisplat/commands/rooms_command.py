"""The command ``bisplat rooms``."""

from __future__ import annotations

from typing import Annotated

from tyro.conf import arg

from bisplat.commands.simulate_command import Output
from scenes.files.errors import printable
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
