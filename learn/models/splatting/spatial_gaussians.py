"""Gaussians in space, and what they look like on the (φ, θ) plane from one place.

A Gaussian with centre p and covariance Σ is seen in the direction of p. Its covariance on the plane is ``J Σ Jᵀ``, with
J the derivative of (φ, λ) at p: the projection is taken as linear over the Gaussian [kerbl2023].
"""

from __future__ import annotations

import numpy as np
import torch
from jaxtyping import Float
from scipy.spatial import cKDTree
from torch import Tensor, nn

from learn.models.splatting.splat import Conic

NEIGHBOURS = 3
"""A Gaussian starts as large as its nearest neighbours are far, so that fewer ones fill the same space."""

LEAST_ACROSS = 1e-3
"""Least distance from the vertical axis for J, metres; azimuth has no derivative on the axis."""


def neighbour_distance(place: Float[np.ndarray, "N_p 3"]) -> Float[np.ndarray, " N_p"]:
    """Root mean square distance from each point to its nearest neighbours.

    >>> neighbour_distance(np.array([[0.0, 0, 0], [3, 0, 0], [3, 4, 0]])).round(2).tolist()
    [4.12, 3.54, 4.53]
    """
    nearest = range(2, min(NEIGHBOURS, len(place) - 1) + 2)  # the first is the point itself
    return np.sqrt(np.square(cKDTree(place).query(place, nearest)[0]).mean(axis=1))


def rotation_matrix(quaternion: Float[Tensor, "*batch 4"]) -> Float[Tensor, "*batch 3 3"]:
    """The rotation of a quaternion (w, x, y, z) of any length but zero.

    >>> rotation_matrix(torch.tensor([2.0, 0.0, 0.0, 2.0])).round().tolist()  # a quarter turn about z
    [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    """
    w, x, y, z = nn.functional.normalize(quaternion, dim=-1).unbind(-1)
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
    return torch.stack([torch.stack(row, dim=-1) for row in rows], dim=-2)


def directions(
    place: Float[Tensor, "*batch 3"],
) -> tuple[Float[Tensor, "*batch"], Float[Tensor, "*batch"], Float[Tensor, "*batch 2 3"]]:
    """Azimuth φ in [0, 360) and latitude λ in [−90, 90] of places seen from the origin, degrees, and d(φ, λ)/dp.

    >>> azimuth, latitude, change = directions(torch.tensor([0.0, 1.0, 1.0]))
    >>> round(azimuth.item()), round(latitude.item()), round(change[1, 2].deg2rad().item(), 3)  # of λ, upwards
    (90, 45, 0.5)
    """
    x, y, z = place.unbind(-1)
    across = (x.square() + y.square()).clamp_min(LEAST_ACROSS**2).sqrt()
    far = across.square() + z.square()
    azimuth, latitude = torch.atan2(y, x).rad2deg().remainder(360), torch.atan2(z, across).rad2deg()
    by_azimuth = torch.stack([-y, x, torch.zeros_like(x)], dim=-1) / across.square()[..., None]
    by_latitude = torch.stack([-x * z, -y * z, across.square()], dim=-1) / (far * across)[..., None]
    return azimuth, latitude, torch.stack([by_azimuth, by_latitude], dim=-2).rad2deg()


def conic_of_axes(axes: Float[Tensor, "*batch 2 3"], blur: float) -> Conic:
    """a, b, c of the inverse of ``A Aᵀ + blur · 1``, for the matrix A of a Gaussian's axes as they are seen.

    The determinant is a sum of squares, ``|A_1 × A_2|² + blur (|A_1|² + |A_2|²) + blur²``, which single precision holds
    even for long, thin Gaussians.

    >>> [round(each.item(), 3) for each in conic_of_axes(torch.tensor([[1.0, 0.0, 0.0], [0.0, 3.0, 0.0]]), 1.0)]
    [0.5, -0.0, 0.1]
    """
    first, second = axes.unbind(-2)
    wide, high = first.square().sum(-1), second.square().sum(-1)
    both = torch.linalg.cross(first, second).square().sum(-1)
    determinant = both + blur * (wide + high) + blur**2
    return (high + blur) / determinant, -(first * second).sum(-1) / determinant, (wide + blur) / determinant
