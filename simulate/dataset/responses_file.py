"""Read channels.npz, the element responses of a dataset folder. The documentation describes it."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
from jaxtyping import Complex

from scenes.files.errors import InputError
from scenes.files.input_file import MEGABYTE
from scenes.files.npz_file import Expected, read_npz

LARGEST_NPZ = 2000 * MEGABYTE
"""Most bytes of channels.npz: 15 million positions of a 4 × 4 array."""

RESPONSE_MAGNITUDES = 1e-12, 1e12
"""Bounds of the largest magnitude of a dataset's responses. Models square it in single precision."""


def read_responses(
    path: Path, rows: int | None, elements: int, problems: list[str]
) -> tuple[Complex[np.ndarray, "K elements"] | None, bool]:
    """Read the responses of channels.npz, and whether they were retrieved from the pictures instead of recorded.

    Args:
        path: the file.
        rows: number of positions; any number if None.
        elements: number of the array's elements.
        problems: a sentence on a fault is appended.

    Returns:
        The responses, or None if there is no such file or it is faulty; and whether they were retrieved.
    """
    if not os.path.lexists(path):
        return None, False
    positions = "the" if rows is None else rows
    expected = {
        "channels": Expected(f"responses of {positions} positions × {elements} elements", "c", (rows, elements)),
        "retrieved": Expected("whether the responses were retrieved", "b", optional=True),
    }
    limit = LARGEST_NPZ if rows is None else 16 * rows * elements + MEGABYTE  # at most complex128
    try:
        found = read_npz(path, "an npz archive of responses", expected, min(limit, LARGEST_NPZ))
    except InputError as error:
        problems.append(str(error))
        return None, False
    return found["channels"], bool(found.get("retrieved", False))


def check_responses(
    path: Path, responses: Complex[np.ndarray, "K elements"], retrieved: bool, problems: list[str]
) -> None:
    """Check that responses are finite, not all zero, and of a magnitude that models can square.

    Args:
        path: the file that they were read from.
        responses: element responses, one row for each picture.
        retrieved: whether they were retrieved. Then rows may be missing, that is, not a number.
        problems: a sentence on a fault is appended.
    """
    finite = np.isfinite(responses).all(axis=1)
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
