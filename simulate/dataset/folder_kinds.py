"""Tell the kinds of dataset folders: spectra, powers (RSSI), channels (CSI), rooms, and unfinished ones."""

from __future__ import annotations

import os
from pathlib import Path

POWERS = "gateway_rssi.csv"
"""The file of received powers, which no folder of spectra has."""

CHANNELS = "csidata.npy"
"""The file of channels, which no folder of spectra has."""

PARTS = "parts"
"""The folder in which an unfinished simulation keeps what it has. It is removed at the end."""

ROOMS = "rooms.json"
"""The file that describes a folder of rooms, each of which is a dataset folder."""


def is_rooms(folder: Path) -> bool:
    """Whether a folder holds the datasets of several rooms.

    Args:
        folder: the folder, which need not exist.
    """
    return os.path.lexists(folder / ROOMS)


def is_rssi(folder: Path) -> bool:
    """Whether a folder holds received powers, as NeRF²'s BLE folder does, and no spectra.

    Args:
        folder: the folder, which need not exist.
    """
    return os.path.lexists(folder / POWERS) and not os.path.lexists(folder / "spectrum")


def is_csi(folder: Path) -> bool:
    """Whether a folder holds channels, as NeRF²'s MIMO folder does, and neither spectra nor received powers.

    Args:
        folder: the folder, which need not exist.
    """
    others = (POWERS, "spectrum")
    return os.path.lexists(folder / CHANNELS) and not any(os.path.lexists(folder / name) for name in others)


def unfinished(folder: Path) -> str | None:
    """The sentence on a simulation that was interrupted; None if the folder is none.

    The index files of spectra are written last, after the parts that become the responses.

    >>> from tempfile import mkdtemp
    >>> hall = Path(mkdtemp())
    >>> _ = (hall / "metadata.json").write_text("{}"), (hall / "parts").mkdir()
    >>> unfinished(hall).removeprefix(str(hall))
    ': expected a finished simulation, found an unfinished one: run the same command again to finish it'
    """
    begun = os.path.isdir(folder / PARTS) and os.path.lexists(folder / "metadata.json")
    if not begun or all(os.path.lexists(folder / f"{part}_index.txt") for part in ("train", "test")):
        return None
    return f"{folder}: expected a finished simulation, found an unfinished one: run the same command again to finish it"


def not_spectra(folder: Path) -> str | None:
    """The sentence on a folder of another kind that was given where spectra are expected; None if it is of none.

    >>> from tempfile import mkdtemp
    >>> hall = Path(mkdtemp())
    >>> not_spectra(hall)
    >>> _ = (hall / "csidata.npy").write_bytes(b"")
    >>> not_spectra(hall).removeprefix(str(hall))
    ': expected a dataset of spectra, found channels over subcarriers (CSI), which bisplat check describes and bisplat \
dataset turns into spectra if their positions are known'
    """
    if is_rssi(folder):
        found = "received powers (RSSI), which bisplat check describes"
    elif is_csi(folder):
        found = (
            "channels over subcarriers (CSI), which bisplat check describes and bisplat dataset turns into spectra if "
            "their positions are known"
        )
    elif is_rooms(folder):
        found = "several rooms, each of which is one; bisplat compare takes them together"
    else:
        return None
    return f"{folder}: expected a dataset of spectra, found {found}"
