"""Transmitter positions that the user gives, in a CSV or from Python: checked, and compared with a place's extent."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from io import StringIO
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from scenes.files.errors import InputError, ParameterError, reason, shown
from scenes.files.input_file import MEGABYTE, read_text

FARTHEST = 1e5
"""Metres, of each coordinate. Models keep positions in single precision, which is exact to 4 mm there: a hundredth of
the wavelength at 915 MHz."""

MOST_POSITIONS = 10**6
"""Number of positions in a file or a simulation."""

LARGEST_CSV = 100 * MEGABYTE
"""Bytes of a CSV of positions: a hundred for each of the most positions."""

LONGEST_LINE = 1000
"""Characters of a line of it."""

HINT = "subtract an offset from map coordinates"

FAR = 0.1
"""Distance from the box, as a fraction of the box's diagonal, from which a warning is given."""


def read_points(path: Path) -> Float[np.ndarray, "n 3"]:
    """Read a CSV of positions with the header x,y,z.

    Args:
        path: the CSV.

    Returns:
        The positions, metres, world frame.

    Raises:
        InputError: no regular file of at most ``LARGEST_CSV`` bytes, another header, a row that is not three finite
            numbers within ``FARTHEST``, no rows, or more than ``MOST_POSITIONS``.
    """
    text = read_text(path, "a CSV of positions", LARGEST_CSV)
    try:
        return _points(path, csv.reader(_lines(path, text)))
    except csv.Error as error:
        found = f"found a file that is none ({reason(error)})"
        raise InputError(f"{path}: expected a CSV of positions, {found}") from error


def _lines(path: Path, text: str) -> Iterator[str]:
    for number, line in enumerate(StringIO(text, newline=""), start=1):
        if len(line) > LONGEST_LINE:
            raise InputError(
                f"{path}, line {number}: expected at most {LONGEST_LINE} characters, found {len(line)}: {shown(line)}"
            )
        yield line


def _points(path: Path, rows: Iterator[list[str]]) -> Float[np.ndarray, "n 3"]:
    header = next(rows, [])
    if [name.strip() for name in header] != ["x", "y", "z"]:
        found = shown(",".join(header)) if header else "an empty file or line"
        raise InputError(f"{path}, line 1: expected the header x,y,z, found {found}")
    points = []
    for number, row in enumerate(rows, start=1):
        if number > MOST_POSITIONS:
            raise InputError(f"{path}: expected at most {MOST_POSITIONS} positions, found more")
        where = f"{path}, position {number} (line {number + 1})"
        found = shown(",".join(row)) if row else "an empty line"
        try:
            point = [float(value) for value in row]
        except ValueError:
            point = []
        if len(point) != 3 or not np.isfinite(point).all():
            raise InputError(f"{where}: expected three finite numbers in metres, found {found}")
        if np.abs(point).max() > FARTHEST:
            raise InputError(f"{where}: expected coordinates within ±{FARTHEST:g} m, found {found}; {HINT}")
        points.append(point)
    if not points:
        raise InputError(f"{path}: expected at least one position after the header, found none")
    return np.array(points, dtype=float)


def check_points(positions: ArrayLike) -> Float[np.ndarray, "n 3"]:
    """Positions from Python, in double precision.

    Args:
        positions: metres, world frame.

    Raises:
        ParameterError: no rows of three finite numbers within ``FARTHEST``, or more than ``MOST_POSITIONS``.

    >>> check_points([[1, 2, 3]])
    array([[1., 2., 3.]])
    """
    try:
        points = np.asarray(positions, dtype=float)
    except (ValueError, TypeError, OverflowError):
        raise ParameterError("positions", f"expected rows of x, y, z, found {shown(positions)}") from None
    if points.ndim != 2 or points.shape[1] != 3 or not 1 <= len(points) <= MOST_POSITIONS:
        found = f"found shape {points.shape}"
        raise ParameterError("positions", f"expected 1 to {MOST_POSITIONS} rows of x, y, z, {found}")
    wrong = np.flatnonzero(~(np.abs(points) <= FARTHEST).all(axis=1))
    if len(wrong):
        row = int(wrong[0])
        what = "finite numbers" if not np.isfinite(points[row]).all() else f"coordinates within ±{FARTHEST:g} m"
        raise ParameterError("positions", f"expected {what}, found {points[row].tolist()} in row {row}")
    return points


def reach_warning(
    positions: Float[np.ndarray, "K 3"], box: Float[np.ndarray, "2 3"], of: str, consequence: str
) -> str | None:
    """A sentence about positions far outside a box; None: there are none.

    Args:
        positions: metres, world frame.
        box: its lowest and highest corner, metres, world frame.
        of: what the box is around.
        consequence: the end of the sentence.

    >>> points = np.array([[1.0, 1, 1], [2, 2, 2.3], [9, 2, 1]])
    >>> reach_warning(points, np.array([[0.0, 0, 0], [2, 2, 2]]), "the scene", "are they in metres?")
    '1 of 3 positions is far outside the box around the scene, x 0 to 2, y 0 to 2 and z 0 to 2 m (the farthest, number \
3, by 7 m); are they in metres?'
    """
    low, high = box
    outside = np.linalg.norm(np.maximum(low - positions, 0) + np.maximum(positions - high, 0), axis=1)
    far = outside > FAR * np.linalg.norm(high - low)
    if not far.any():
        return None
    sides = [f"{axis} {a:.3g} to {b:.3g}" for axis, a, b in zip("xyz", low, high, strict=True)]
    return (
        f"{far.sum()} of {len(far)} positions {'is' if far.sum() == 1 else 'are'} far outside the box around {of}, "
        f"{sides[0]}, {sides[1]} and {sides[2]} m (the farthest, number {outside.argmax() + 1}, by "
        f"{outside.max():.2g} m); {consequence}"
    )
