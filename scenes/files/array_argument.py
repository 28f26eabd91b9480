"""Arrays that a user gives from Python: refused unless they are plain numbers of the expected shape."""

from __future__ import annotations

from types import EllipsisType

import numpy as np
from numpy.typing import ArrayLike

from scenes.files.errors import ParameterError, shown

KINDS = {"f": "numbers", "c": "complex numbers"}
"""Kinds of numbers to expect, by NumPy's codes. Real numbers count as complex ones, too."""


def check_array(
    parameter: str,
    value: ArrayLike,
    shape: tuple[int | EllipsisType | None, ...],
    what: str,
    kind: str = "f",
    finite: bool = True,
) -> np.ndarray:
    """Check an array, and return it in double precision.

    NumPy would drop the mask of a masked array and the imaginary parts of complex numbers, and read texts and truth
    values as numbers.

    >>> check_array("corners", [[0, 0, 0], [1, 2, 3]], (2, 3), "two corners").tolist()
    [[0.0, 0.0, 0.0], [1.0, 2.0, 3.0]]
    >>> check_array("corners", [0, 1], (2, 3), "two corners")
    Traceback (most recent call last):
    scenes.files.errors.ParameterError: corners: expected two corners, found shape (2,)
    """
    if np.ma.isMaskedArray(value):
        raise ParameterError(parameter, f"expected {what}, found a masked array")
    try:
        array = np.asarray(value)
    except (TypeError, ValueError, OverflowError):  # of the value's own __array__, or rows of different lengths
        array = np.array(None)
    if array.dtype.kind not in ("iuf" if kind == "f" else "iufc"):
        found = f"{array.dtype.name} numbers" if array.dtype.kind == "c" else shown(value)
        raise ParameterError(parameter, f"expected {what} ({KINDS[kind]}), found {found}")
    if not _fits(array.shape, shape):
        raise ParameterError(parameter, f"expected {what}, found shape {array.shape}")
    with np.errstate(over="ignore"):
        array = array.astype(float if kind == "f" else complex, order="C")  # torch takes no negative strides
    if finite and not np.isfinite(array).all():
        where = np.argwhere(~np.isfinite(array))[0].tolist()
        place = f" at {where}" if where else ""
        raise ParameterError(parameter, f"expected {what}, all finite, found {array[tuple(where)]}{place}")
    return array


def _fits(found: tuple[int, ...], shape: tuple[int | EllipsisType | None, ...]) -> bool:
    if shape[:1] == (...,):
        shape = shape[1:]
        found = found[max(len(found) - len(shape), 0) :]
    return len(found) == len(shape) and all(want in (None, has) for want, has in zip(shape, found, strict=True))
