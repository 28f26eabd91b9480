"""Where the search for a transmitter begins: the most likely points of a grid, each some way from the others."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

MODES = 4
"""Largest number of positions that are considered for a transmitter."""


def starting_points(
    points: Float[np.ndarray, "n 3"], likely: Float[np.ndarray, " n"], apart: float
) -> Float[np.ndarray, "MODES 3"]:
    """The most likely point, then the next ones that are far enough from all before. The last one may repeat."""
    left, starts = likely.copy(), list[np.ndarray]()
    for _ in range(MODES):
        best = int(left.argmax())
        starts.append(points[best] if left[best] > -np.inf else starts[-1])
        left[np.linalg.norm(points - points[best], axis=1) < apart] = -np.inf
    return np.stack(starts)
