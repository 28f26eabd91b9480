"""Read the predictions of a benchmark's test rows from a folder, in the order of the task's test_index.txt."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Complex, Float

from learn.powers.known_powers import PredictedPowers
from scenes.files.errors import InputError, named
from scenes.files.input_file import MEGABYTE, what_is_at
from scenes.files.npz_file import Expected, read_npy
from simulate.dataset.picture_files import read_picture
from simulate.rssi.rssi_files import read_powers
from simulate.spectra.angular_grid import COLUMNS, ROWS
from simulate.spectra.spectrum import spectrum_of

SPECTRA, POWERS, DOWNLINK = "spectra.npy", "gateway_rssi.csv", "downlink.npy"
LOW, HIGH = "gateway_rssi_low.csv", "gateway_rssi_high.csv"

LARGEST = 4000 * MEGABYTE
"""Most bytes of an array."""

BRIGHTEST = 2.0
"""Spectra are from 0 to 1, and predictions may overshoot. Grey levels of 255 are far above this."""


def require_folder(folder: Path) -> None:
    """Raise an InputError if there is no folder of predictions."""
    if not folder.is_dir():
        raise InputError(f"{folder}: expected a folder of predictions, found {what_is_at(folder)}")


def predicted_spectra(folder: Path, names: Sequence[str]) -> Float[np.ndarray, "K 90 360"]:
    """Predicted spectra: spectra.npy with real numbers [K, 90, 360], or a PNG of 8-bit grey for each test row."""
    require_folder(folder)
    path = folder / SPECTRA
    if not path.exists():
        if not any(folder.glob("*.png")):
            raise InputError(
                f"{folder}: expected {SPECTRA}, or a picture NAME.png of each test spectrum, found neither"
            )
        return spectrum_of(np.stack([read_picture(folder / f"{name}.png") for name in names]))
    shape = len(names), ROWS, COLUMNS
    spectra = read_npy(path, Expected(f"spectra {list(shape)} of the test rows", "f", shape), LARGEST)
    _require_finite(path, spectra)
    if spectra.dtype.kind != "f" or np.abs(spectra).max() > BRIGHTEST:
        found = f"{spectra.dtype} up to {spectra.max():g}"
        raise InputError(f"{path}: expected numbers from 0 to 1 (grey levels / 255), found {found}")
    return spectra


def predicted_powers(folder: Path, gateways: Sequence[str], count: int) -> PredictedPowers:
    """Predicted powers: gateway_rssi.csv, and with stated 90 % intervals gateway_rssi_low.csv and _high.csv.

    A power below the floor, such as −100, predicts that nothing is received.
    """
    require_folder(folder)
    median = _powers(folder / POWERS, gateways, count)
    ends = [path for path in (folder / LOW, folder / HIGH) if path.exists()]
    if not ends:
        return PredictedPowers(median)
    low, high = (_powers(folder / name, gateways, count) for name in (LOW, HIGH))
    wrong = (low > high).any(axis=1)
    if wrong.any():
        row = int(np.flatnonzero(wrong)[0])
        found = f"one above it in {int(wrong.sum())} rows, first in row {row} (counted from 0)"
        raise InputError(f"{folder / LOW}: expected no power above that of {HIGH}, found {found}")
    return PredictedPowers(median, low, high)


def predicted_downlink(folder: Path, shape: tuple[int, int, int]) -> Complex[np.ndarray, "K A S"]:
    """Predicted channels of the downlink: downlink.npy with complex numbers [K, antennas, subcarriers]."""
    require_folder(folder)
    path = folder / DOWNLINK
    channels = read_npy(path, Expected(f"channels {list(shape)} of the test rows", "c", shape), LARGEST)
    _require_finite(path, channels)
    return channels


def digest(folder: Path) -> str:
    """SHA-256 of the names and contents of the files in a folder of predictions."""
    found = hashlib.sha256()
    for path in sorted(each for each in folder.iterdir() if each.is_file()):
        found.update(path.name.encode() + b"\0" + hashlib.sha256(path.read_bytes()).digest())
    return found.hexdigest()


def _powers(path: Path, gateways: Sequence[str], count: int) -> Float[np.ndarray, "K G"]:
    names, powers = read_powers(path)
    for name in gateways:
        if name not in names:
            raise InputError(f"{path}, line 1: expected a column for each gateway, found none of {named(name)}")
    if len(powers) != count:
        raise InputError(f"{path}: expected a row for each of the {count} test positions, found {len(powers)} rows")
    return powers[:, [names.index(name) for name in gateways]]


def _require_finite(path: Path, numbers: np.ndarray) -> None:
    whole = np.isfinite(numbers).all(axis=(1, 2))
    if not whole.all():
        row = int(np.flatnonzero(~whole)[0])
        raise InputError(
            f"{path}: expected finite numbers, found others in {int((~whole).sum())} of {len(whole)} rows, first in "
            f"row {row} (counted from 0)"
        )
