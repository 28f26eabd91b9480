"""Tell a folder of received powers (RSSI) from one of spectra."""

from __future__ import annotations

import os
from pathlib import Path

POWERS = "gateway_rssi.csv"
"""The file of received powers, which no folder of spectra has."""


def is_rssi(folder: Path) -> bool:
    """Whether a folder holds received powers, as NeRF²'s BLE folder does, and no spectra.

    Args:
        folder: the folder, which need not exist.
    """
    return os.path.lexists(folder / POWERS) and not os.path.lexists(folder / "spectrum")


def not_spectra(folder: Path) -> str:
    """The sentence on a folder of received powers that was given where spectra are expected.

    >>> not_spectra(Path("hall"))
    'hall: expected a dataset of spectra, found received powers (RSSI); bisplat check describes them'
    """
    return f"{folder}: expected a dataset of spectra, found received powers (RSSI); bisplat check describes them"
