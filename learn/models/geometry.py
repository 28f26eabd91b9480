"""Distances of points, and directions spread evenly over the sphere."""

from __future__ import annotations

import torch
from jaxtyping import Float
from torch import Tensor


def distances(a: Float[Tensor, "*b n d"], b: Float[Tensor, "*b m d"]) -> Float[Tensor, "*b n m"]:
    """Distances of points; differences are taken, since the faster method of torch.cdist is exact to millimetres only.

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
