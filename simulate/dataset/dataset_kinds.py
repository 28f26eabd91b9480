"""Which quantities there are, which folder is of which, and the words for both. Imports little, as help must."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Literal, NamedTuple

from scenes.files.errors import InputError

POWERS = "gateway_rssi.csv"  # The file of received powers

CHANNELS = "csidata.npy"  # The file of channels

ROOMS = "rooms.json"  # The file that describes a folder of rooms, each of which is a dataset folder

PARTS = "parts"
"""The folder in which an unfinished simulation keeps what it has. It is removed at the end."""

NOT_RECEIVED = -100.0
"""dBm; stands in gateway_rssi.csv where nothing was received. NeRF² and GSRF leave such entries out."""

STRONGEST = 60.0  # dBm; largest power that is believed: 1 kW at the receiver

TAKE_POWERS = "train, compare, locate, plan, predict --map, calibrate, view and export --hdf5"
TAKE_CHANNELS = "train and compare"
TAKE_PLACED_CHANNELS = "locate and view"
"""The commands that take received powers, channels, and channels whose positions are known."""


class Quantity(NamedTuple):
    """What rows of a dataset can hold."""

    words: str  # what it is, in the plural
    rows: str = "spectra"  # what its rows are called
    mark: str = ""  # the file or folder that tells a folder of it; nothing: such a folder has another quantity, too
    taken: str = ""  # what takes it, as the end of a sentence


QUANTITIES = {
    "spectrum": Quantity("spectra", mark="spectrum"),
    "response": Quantity("element responses"),
    "retrieved": Quantity("element responses that have a phase of their own each"),
    "power": Quantity(
        "received powers (RSSI)",
        "positions",
        POWERS,
        f", which bisplat check describes and bisplat {TAKE_POWERS} take",
    ),
    "channel": Quantity(
        "channels over subcarriers (CSI)",
        "rows",
        CHANNELS,
        f", which bisplat check describes and bisplat {TAKE_CHANNELS} take; if their positions are known, bisplat "
        f"{TAKE_PLACED_CHANNELS} take them, and bisplat dataset turns them into spectra",
    ),
}
"""The quantities by name. A folder is of the first one whose mark it has."""

Moving = Literal["transmitter", "receiver", "both"]
"""What moves. An end that does not move stands at the gateway's position. If the receiver moves, its array keeps the
gateway's orientation. "RX moving" is the name that SwiftWRF [liu2025] gives to data of a moving receiver. If both move,
the positions are the transmitters', and those of the array are stated beside them."""

Phases = Literal["common", "per-position"]
"""Whether phases of different positions can be compared. common: they can, as with a transmitter that is synchronised
with the receiver, or a tag that answers its reader. per-position: each position has an unknown phase of its own."""

Setting = Literal["same", "furniture", "layout"]
"""What differs from room to room: the transmitter's positions alone, the furniture too, or everything."""

Outline = Literal["rectangle", "l", "both"]
"""Outlines of rooms; of "both", every second room is L-shaped."""


def is_rooms(folder: Path) -> bool:
    """Whether a folder holds the datasets of several rooms."""
    return os.path.lexists(folder / ROOMS)


def quantity_of(folder: Path) -> str | None:
    """The name of the quantity that a dataset folder is of; None for any other folder, rooms among them."""
    if is_rooms(folder):
        return None
    return next((name for name, each in QUANTITIES.items() if each.mark and os.path.lexists(folder / each.mark)), None)


def content_of(folder: Path) -> str | None:
    """What a folder of data holds, in words, and what takes it; None if it holds none."""
    if is_rooms(folder):
        return "several rooms, each of which is a dataset of spectra; bisplat compare takes them together"
    name = quantity_of(folder)
    return None if name is None else QUANTITIES[name].words + QUANTITIES[name].taken


def require_spectra(folder: Path) -> None:
    """Refuse a folder of other data where a folder of spectra is expected."""
    if is_rooms(folder) or quantity_of(folder) not in (None, "spectrum"):
        raise InputError(f"{folder}: expected a dataset of spectra, found {content_of(folder)}")


def unfinished(folder: Path) -> str | None:
    """The sentence on a simulation that was interrupted; None if the folder is none."""
    begun = os.path.isdir(folder / PARTS) and os.path.lexists(folder / "metadata.json")
    if not begun or all(os.path.lexists(folder / f"{part}_index.txt") for part in ("train", "test")):
        return None
    return f"{folder}: expected a finished simulation, found an unfinished one: run the same command again to finish it"
