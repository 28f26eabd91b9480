"""Distances between points, directions spread evenly over the sphere, and grids."""

from __future__ import annotations

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor


def distances(a: Float[Tensor, "*b n d"], b: Float[Tensor, "*b m d"]) -> Float[Tensor, "*b n m"]:
    """Distances between points.

    They are computed from differences, since the faster method of torch.cdist is exact only to millimetres.

    >>> distances(torch.zeros(1, 3), torch.tensor([[3.0, 4.0, 0.0]])).tolist()
    [[5.0]]
    """
    return torch.linalg.vector_norm(a[..., :, None, :] - b[..., None, :, :], dim=-1)


def evenly_spread_directions(count: int) -> Float[Tensor, "count 3"]:
    """Unit vectors on a Fibonacci spiral; each represents the same solid angle."""
    index = torch.arange(count) + 0.5
    z, azimuth = 1 - 2 * index / count, torch.pi * (1 + 5**0.5) * index
    across = (1 - z.square()).sqrt()
    return torch.stack([across * azimuth.cos(), across * azimuth.sin(), z], dim=-1)


def grid_in(region: Float[np.ndarray, "2 3"], spacing: float, most: int) -> Float[np.ndarray, "n 3"]:
    """Points of a grid that includes the corners of a box.

    >>> box = np.array([[0.0, 0, 0], [1, 1, 1]])
    >>> len(grid_in(box, 0.5, most=1000)), len(grid_in(box, 0.01, most=8))
    (27, 8)
    """
    counts = np.maximum(2, np.ceil((region[1] - region[0]) / spacing - 1e-9) + 1)
    while counts.prod() > 1.5 * most and counts.max() > 2:
        counts = np.maximum(2, np.floor(counts * 0.9))
    axes = [np.linspace(low, high, int(count)) for low, high, count in zip(*region, counts, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
