"""What kinds of dataset folders there are, and the words for what differs among them. Imports little, as help must."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Literal

POWERS = "gateway_rssi.csv"  # The file of received powers, which no folder of spectra has

CHANNELS = "csidata.npy"  # The file of channels, which no folder of spectra has

PARTS = "parts"
"""The folder in which an unfinished simulation keeps what it has. It is removed at the end."""

ROOMS = "rooms.json"  # The file that describes a folder of rooms, each of which is a dataset folder

TAKE_POWERS = "compare, evaluate, locate, plan, coverage, calibrate, view and export --hdf5"
TAKE_CHANNELS = "compare and evaluate"
TAKE_PLACED_CHANNELS = "locate and view"
"""The commands that take received powers, channels, and channels whose positions are known."""

SPECTRA = "spectra"  # ``content_of`` a dataset of spectra

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


def is_rssi(folder: Path) -> bool:
    """Whether a folder holds received powers, as NeRF²'s BLE folder does, and no spectra."""
    return os.path.lexists(folder / POWERS) and not os.path.lexists(folder / "spectrum")


def is_csi(folder: Path) -> bool:
    """Whether a folder holds channels, as NeRF²'s MIMO folder does, and neither spectra nor received powers."""
    others = (POWERS, "spectrum")
    return os.path.lexists(folder / CHANNELS) and not any(os.path.lexists(folder / name) for name in others)


def unfinished(folder: Path) -> str | None:
    """The sentence on a simulation that was interrupted; None if the folder is none."""
    begun = os.path.isdir(folder / PARTS) and os.path.lexists(folder / "metadata.json")
    if not begun or all(os.path.lexists(folder / f"{part}_index.txt") for part in ("train", "test")):
        return None
    return f"{folder}: expected a finished simulation, found an unfinished one: run the same command again to finish it"


def content_of(folder: Path) -> str | None:
    """What a dataset folder holds, and what takes data that are no spectra; None if it is of no kind."""
    if is_rssi(folder):
        return f"received powers (RSSI), which bisplat check describes and bisplat {TAKE_POWERS} take"
    if is_csi(folder):
        return (
            f"channels over subcarriers (CSI), which bisplat check describes and bisplat {TAKE_CHANNELS} take; if "
            f"their positions are known, bisplat {TAKE_PLACED_CHANNELS} take them, and bisplat dataset turns them into "
            "spectra"
        )
    if is_rooms(folder):
        return "several rooms, each of which is a dataset of spectra; bisplat compare takes them together"
    return SPECTRA if os.path.lexists(folder / "spectrum") else None


def not_spectra(folder: Path) -> str | None:
    """The sentence on a folder of another kind that was given where spectra are expected; None if it is of none."""
    found = content_of(folder)
    return None if found in (None, SPECTRA) else f"{folder}: expected a dataset of spectra, found {found}"
