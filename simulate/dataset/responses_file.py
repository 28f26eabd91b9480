"""Read channels.npz, the element responses of a dataset folder. The documentation describes it."""

from __future__ import annotations

import os
from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex

from scenes.files.errors import InputError
from scenes.files.input_file import MEGABYTE
from scenes.files.npz_file import Expected, read_npz
from simulate.spectra.band import Band

LARGEST_NPZ = 2000 * MEGABYTE
"""Most bytes of channels.npz: 15 million positions of a 4 × 4 array."""

RESPONSE_MAGNITUDES = 1e-12, 1e12
"""Bounds of the largest magnitude of a dataset's responses. Models square it in single precision."""


class Responses(NamedTuple):
    """Content of channels.npz."""

    # responses at the carrier; None if there is no such file or it is faulty
    channels: Complex[np.ndarray, "K elements"] | None = None
    retrieved: bool = False  # whether they have unknown phases of their own, such as those found behind pictures
    # responses at all subcarriers; None if there are none
    over_band: Complex[np.ndarray, "K elements subcarriers"] | None = None


def read_responses(
    path: Path, rows: int | None, elements: int, problems: list[str], band: Band | None = None
) -> Responses:
    """Read channels.npz."""
    if not os.path.lexists(path):
        return Responses()
    positions = "the" if rows is None else rows
    expected = {
        "channels": Expected(f"responses of {positions} positions × {elements} elements", "c", (rows, elements)),
        "retrieved": Expected("whether the responses were retrieved", "b", optional=True),
    }
    numbers = 1
    if band is not None:
        shape = (rows, elements, band.subcarriers)
        what = f"responses of {positions} positions × {elements} elements × {band.subcarriers} subcarriers"
        expected["band"] = Expected(what, "c", shape)
        numbers += band.subcarriers
    limit = LARGEST_NPZ if rows is None else 16 * rows * elements * numbers + MEGABYTE  # at most complex128
    try:
        found = read_npz(path, "an npz archive of responses", expected, min(limit, LARGEST_NPZ))
    except InputError as error:
        problems.append(str(error))
        return Responses()
    return Responses(found["channels"], bool(found.get("retrieved", False)), found.get("band"))


def check_responses(
    path: Path, responses: Complex[np.ndarray, "K elements *band"], retrieved: bool, problems: list[str]
) -> None:
    """Check that responses are finite, not all zero, and of a magnitude that models can square."""
    finite = np.isfinite(responses).reshape(len(responses), -1).all(axis=1)
    if not (retrieved or finite.all()):
        problems.append(
            f"{path}: expected finite responses, found others in {int((~finite).sum())} rows, first in that of "
            f"picture {int(np.flatnonzero(~finite)[0]) + 1} of {len(responses)}"
        )
        return
    low, high = RESPONSE_MAGNITUDES
    with np.errstate(over="ignore"):
        largest = float(np.abs(responses[finite]).max(initial=0))
    if not low <= largest <= high:
        problems.append(f"{path}: expected a largest magnitude from {low:g} to {high:g}, found {largest:.4g}")
