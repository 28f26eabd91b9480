"""Find the nearest triangle at each pixel of a drawing, to hide what is behind it.

Matplotlib sorts whole triangles by their centres. It would draw half of a whiteboard behind its wall.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

PAIRS = 4_000_000
"""Most pairs of a triangle and a pixel that are processed together. This limits the memory."""


@dataclass(frozen=True)
class DepthBuffer:
    """The nearest triangle at each pixel."""

    # left, right, bottom and top edge of the drawing, in the units of the triangles
    extent: tuple[float, float, float, float]
    # depth of the nearest triangle, infinite if there is none. Row 0 is at the bottom.
    depth: Float[np.ndarray, "rows columns"]
    nearest: Int[np.ndarray, "rows columns"]  # index of the nearest triangle, −1 if there is none

    def shows(self, points: Float[np.ndarray, "n 3"], tolerance: float) -> Bool[np.ndarray, " n"]:
        """Whether each point is visible: no triangle is in front of it."""
        left, right, bottom, top = self.extent
        rows, columns = self.depth.shape
        column = ((points[:, 0] - left) / (right - left) * columns).astype(int).clip(0, columns - 1)
        row = ((points[:, 1] - bottom) / (top - bottom) * rows).astype(int).clip(0, rows - 1)
        return points[:, 2] <= self.depth[row, column] + tolerance


def barycentric(
    a: Float[np.ndarray, "n 2"], b: Float[np.ndarray, "n 2"], c: Float[np.ndarray, "n 2"]
) -> tuple[Float[np.ndarray, "n 3"], Bool[np.ndarray, " n"]]:
    """Return the barycentric coordinates of the origin in flat triangles, and whether each triangle covers it.

    >>> weights, covered = barycentric(*np.array([[[-1.0, -1.0]], [[1.0, -1.0]], [[0.0, 1.0]]]))
    >>> weights.tolist(), covered.tolist()
    ([[0.25, 0.25, 0.5]], [True])
    """
    parts = np.stack([u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0] for u, v in ((b, c), (c, a), (a, b))], axis=1)
    whole = parts.sum(axis=1, keepdims=True)
    weights = parts / np.where(whole == 0, np.nan, whole)  # a triangle seen edge-on covers nothing
    return weights, np.all(weights >= 0, axis=1)


def depth_buffer(
    triangles: Float[np.ndarray, "n 3 3"], extent: tuple[float, float, float, float], columns: int
) -> DepthBuffer:
    """Find the nearest triangle at each pixel.

    >>> near, far = [[0, 0, 1], [2, 0, 1], [0, 2, 1]], [[0, 0, 5], [4, 0, 5], [0, 4, 5]]
    >>> depth_buffer(np.array([far, near], dtype=float), (0, 4, 0, 4), 4).nearest[::-1]
    array([[ 0, -1, -1, -1],
           [ 0,  0, -1, -1],
           [ 1,  0,  0, -1],
           [ 1,  1,  0,  0]])
    """
    left, right, bottom, top = extent
    pixel = (right - left) / columns
    rows = max(1, round((top - bottom) / pixel))
    depth, nearest = np.full(rows * columns, np.inf), np.full(rows * columns, -1)
    corners = (
        triangles[:, :, :2] - [left, bottom]
    ) / pixel - 0.5  # in pixels, with whole numbers at the centres of pixels
    first = np.ceil(corners.min(axis=1)).clip(0).astype(int)
    last = np.floor(corners.max(axis=1)).clip(-1, [columns - 1, rows - 1]).astype(int)
    wide, high = (last - first + 1).clip(0).T
    ends = np.cumsum(wide * high)
    start = 0
    while start < len(triangles):
        done = ends[start - 1] if start else 0
        stop = max(start + 1, int(np.searchsorted(ends, done + PAIRS, side="right")))
        which = np.repeat(np.arange(start, stop), (wide * high)[start:stop])
        number = np.arange(len(which)) - (ends - wide * high - done)[which]
        across, up = first[which, 0] + number % wide[which], first[which, 1] + number // wide[which]
        a, b, c = np.moveaxis(corners[which] - np.stack([across, up], axis=1)[:, None], 1, 0)
        weights, covered = barycentric(a, b, c)
        which, at = which[covered], (up * columns + across)[covered]
        z = (weights[covered] * triangles[which, :, 2]).sum(axis=1)
        nearer = np.flatnonzero(z < depth[at])
        nearer = nearer[
            np.argsort(-z[nearer], kind="stable")
        ]  # of several triangles at a pixel, the last one written remains
        depth[at[nearer]], nearest[at[nearer]] = z[nearer], which[nearer]
        start = stop
    return DepthBuffer(extent, depth.reshape(rows, columns), nearest.reshape(rows, columns))
