"""Refuse damaged arrays of a mesh before anything is computed from them."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Integer

from scenes.files.errors import InputError
from scenes.scene.description import MOST_TRIANGLES

LARGEST = 1e10
"""Largest coordinate, in the file's unit: that of UTM in millimetres. Damaged files have coordinates such as 1e30."""


def require_ordinary(vertices: Float[np.ndarray, "V 3"], label: str) -> None:
    """Refuse coordinates that are not finite or that are absurdly large."""
    faulty = np.flatnonzero(~(np.abs(vertices) <= LARGEST).all(axis=1))  # also NaN
    if len(faulty):
        raise InputError(
            f"{label}: expected coordinates within ±{LARGEST:g}, found {vertices[faulty[0]].tolist()} at vertex "
            f"{faulty[0]}, counted from 0 ({len(faulty)} of {len(vertices)} vertices have this fault)"
        )


def require_corners(faces: Integer[np.ndarray, "F n"], count: int, label: str) -> None:
    """Refuse faces that refer to vertices that do not exist."""
    outside = (faces < 0) | (faces >= count)
    if outside.any():
        row, column = np.argwhere(outside)[0]
        raise InputError(
            f"{label}: expected corners with vertex numbers from 0 to {count - 1}, found {faces[row, column]} in face "
            f"{row}, counted from 0"
        )


def require_few(triangles: int, label: str) -> None:
    """Refuse more triangles than ``MOST_TRIANGLES``. Raise an InputError that starts with the label."""
    if triangles > MOST_TRIANGLES:
        raise InputError(f"{label}: expected at most {MOST_TRIANGLES} triangles, found {triangles}")
