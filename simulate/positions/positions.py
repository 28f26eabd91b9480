"""Positions: the options that ask for them, and checks of those that a user gives in a CSV or from Python."""

from __future__ import annotations

import csv
import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike
from tyro.conf import arg

from scenes.files.atomic import write_atomically
from scenes.files.errors import InputError, ParameterError, check_array, reason, require_seed, require_whole, shown
from scenes.files.input_file import MEGABYTE, parse_number, read_text
from scenes.files.options import check_kinds

LEAST_POSITIONS = 2  # Fewest positions of a dataset: one to train on and one to test on

NO_FILE = "(default: None)"
"""What the help says of a file that need not be given. The help of tyro would say ['None'], for its constructor."""


@dataclass(frozen=True)
class Places:
    """The positions of a simulated dataset.

    Attributes:
        n: number of transmitter positions to draw.
        placement: how positions are drawn. uniform: at random; grid: evenly; path: along a smooth curve.
        positions: CSV file of positions to use instead (header x,y,z; metres, world frame). In Python also an array.
        seed: seed of the positions, the split, the rays and the receiver's errors or the shadowing.

    Raises:
        ParameterError: ``n`` is no whole number from ``LEAST_POSITIONS`` to ``MOST_POSITIONS``, the seed is not valid,
            or ``placement`` is no placement.
    """

    n: Annotated[int, arg(name="number", aliases=["-n"])] = 6000
    placement: Literal["uniform", "grid", "path"] = "uniform"
    positions: Annotated[
        Float[np.ndarray, "K 3"] | str | Path | None, arg(constructor=Path, metavar="PATH", help_behavior_hint=NO_FILE)
    ] = None
    seed: int = 0

    def __post_init__(self) -> None:
        check_kinds(self)
        require_whole(LEAST_POSITIONS, MOST_POSITIONS, n=self.n)
        require_seed(seed=self.seed)


FARTHEST = 1e5
"""Metres; largest magnitude of a coordinate. Models store positions in single precision, which is exact to 4 mm there:
a hundredth of the wavelength at 915 MHz."""

MOST_POSITIONS = 10**6  # Most positions in a file or a simulation

LARGEST_CSV = 100 * MEGABYTE  # Most bytes of a CSV of positions: a hundred for each position

HINT = "subtract an offset from map coordinates"

FAR = 0.1  # Distance from a box, as a fraction of its diagonal, above which a position is far outside


def read_points(path: Path) -> Float[np.ndarray, "n 3"]:
    """Read a CSV of positions with the header x,y,z."""
    text = read_text(path, "a CSV of positions", LARGEST_CSV)
    try:
        return _points(path, csv.reader(StringIO(text, newline="")))
    except csv.Error as error:
        found = f"found a file that is not a CSV ({reason(error)})"
        raise InputError(f"{path}: expected a CSV of positions, {found}") from error


def _points(path: Path, rows: Iterator[list[str]]) -> Float[np.ndarray, "n 3"]:
    header = next(rows, [])
    if [name.strip() for name in header] != ["x", "y", "z"]:
        found = shown(",".join(header)) if header else "an empty file or line"
        raise InputError(f"{path}, line 1: expected the header x,y,z, of numbers in metres, found {found}")
    points = []
    for number, row in enumerate(rows, start=1):
        if number > MOST_POSITIONS:
            raise InputError(f"{path}: expected at most {MOST_POSITIONS} positions, found more")
        where = f"{path}, position {number} (line {number + 1})"
        found = shown(",".join(row)) if row else "an empty line"
        try:
            point = [parse_number(value) for value in row]
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


def points_digest(points: Float[np.ndarray, "n 3"]) -> str:
    """SHA-256 of positions, which tells whether two files hold the same ones."""
    return hashlib.sha256(np.ascontiguousarray(points).data).hexdigest()


def check_points(positions: ArrayLike, parameter: str = "positions") -> Float[np.ndarray, "n 3"]:
    """Check positions from Python, and return them in double precision."""
    points = check_array(parameter, positions, (None, 3), "rows of x, y, z", finite=False)
    if not 1 <= len(points) <= MOST_POSITIONS:
        raise ParameterError(parameter, f"expected 1 to {MOST_POSITIONS} rows of x, y, z, found {len(points)}")
    wrong = np.flatnonzero(~(np.abs(points) <= FARTHEST).all(axis=1))
    if len(wrong):
        row = int(wrong[0])
        finite = np.isfinite(points[row]).all()
        what = f"coordinates within ±{FARTHEST:g} m" if finite else "finite numbers"
        hint = f"; {HINT}" if finite else ""
        raise ParameterError(parameter, f"expected {what}, found {points[row].tolist()} in row {row}{hint}")
    return points


def reach_warning(
    positions: Float[np.ndarray, "K 3"], box: Float[np.ndarray, "2 3"], of: str, consequence: str
) -> str | None:
    """A sentence on positions far outside a box; None if there are none."""
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


def write_positions(path: Path, positions: Float[np.ndarray, "K 3"]) -> None:
    """Write tx_pos.csv or rx_pos.csv, in metres with 6 decimals."""
    text = StringIO()
    text.write("x,y,z\n")
    np.savetxt(text, positions, fmt="%.6f", delimiter=",")
    write_atomically(path, text.getvalue().encode())


def box_in_words(points: Float[np.ndarray, "n 3"]) -> str:
    """The lowest and the highest corner of the box around points, metres."""
    return " to ".join(str(corner.round(3).tolist()) for corner in (points.min(axis=0), points.max(axis=0)))
