"""Triangles of strips and fans, as graphics hardware draws them."""

from __future__ import annotations

import numpy as np
from jaxtyping import Integer


def strip_triangles(corners: Integer[np.ndarray, " n"]) -> Integer[np.ndarray, "t 3"]:
    """Return the triangles of a strip, all turning the same way as the first.

    >>> strip_triangles(np.array([7, 8, 9, 5])).tolist()
    [[7, 8, 9], [8, 5, 9]]
    """
    first = np.arange(max(len(corners) - 2, 0))
    odd = first % 2
    return corners[np.stack([first, first + 1 + odd, first + 2 - odd], axis=1)]


def fan_triangles(corners: Integer[np.ndarray, " n"]) -> Integer[np.ndarray, "t 3"]:
    """Return the triangles of a fan around the first corner.

    >>> fan_triangles(np.array([7, 8, 9, 5])).tolist()
    [[7, 8, 9], [7, 9, 5]]
    """
    second = np.arange(1, max(len(corners) - 1, 1))
    return corners[np.stack([np.zeros_like(second), second, second + 1], axis=1)]
