"""Depth-ordered splatting of complex coefficients on the (φ, θ) plane, with periodic azimuth [kerbl2023].

Complex numbers are pairs (real, imaginary) along the last axis, which all compilers and exporters support. A Gaussian
in space has the covariance ``J Σ Jᵀ`` on the plane, with the derivative J of the direction by its place.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import torch
from jaxtyping import Float
from scipy.spatial import cKDTree
from torch import Tensor, nn

from learn.models.splatting.ordered import Conic, Ordered

WHOLE = 1e-3  # A number of columns this near a whole one is whole: a grid's azimuths are in single precision
MOST_TURN = 4  # largest ratio of the columns of one turn, which the fast renderers compute, to those of the grid


class Splats(NamedTuple):
    """Primitives of B transmitters, in any order."""

    azimuth: Float[Tensor, " N_p"]  # φ_i, degrees
    elevation: Float[Tensor, " N_p"]  # θ_i, degrees
    depth: Float[Tensor, " N_p"]  # d_i
    scale: Float[Tensor, "B N_p 2"]  # standard deviations, degrees
    rotation: Float[Tensor, "B N_p"]  # ρ_i, radians
    opacity: Float[Tensor, "B N_p"]  # o_i
    coefficient: Float[Tensor, "B N_p 2"]  # c_i (real, imaginary)


def splat(splats: Splats, azimuths: Float[Tensor, " W"], elevations: Float[Tensor, " H"]) -> Float[Tensor, "B H W 2"]:
    """The complex field ``F = Σ_i c_i α_i Π_{j<i} (1 − α_j)`` with ``α_i = o_i G_i(φ, θ)``, nearer primitives first."""
    order = torch.argsort(splats.depth, stable=True)
    ordered = Ordered(
        splats.azimuth[..., order],
        splats.elevation[..., order],
        conic_of(splats.scale[:, order], splats.rotation[:, order]),
        splats.opacity[:, order],
        splats.coefficient[:, order],
    )
    return splat_in_order(ordered, azimuths, elevations)


def splat_in_order(
    ordered: Ordered, azimuths: Float[Tensor, " W"], elevations: Float[Tensor, " H"]
) -> Float[Tensor, "B H W 2"]:
    """The field of primitives by the fastest renderer that the device has."""
    turn = None if torch.compiler.is_exporting() else _turn(azimuths)
    if turn is None or ordered.opacity.device.type not in ("cpu", "cuda"):
        return splat_reference(ordered, azimuths, elevations)  # its operators exist in every runtime
    if ordered.opacity.device.type == "cpu":
        from learn.models.splatting.splat_cpu import splat_cpu as renderer  # Numba takes long to import
    else:
        from learn.models.splatting.splat_triton import splat_triton as renderer  # only CUDA builds have Triton
    if azimuths[1] < 0:  # the mirror image of a grid whose azimuths increase
        a, b, c = ordered.conic
        ordered = ordered._replace(azimuth=(-ordered.azimuth).remainder(360), conic=(a, -b, c))
    field = renderer(ordered, turn, elevations)
    if len(turn) == len(azimuths):
        return field
    return field[:, :, torch.arange(len(azimuths), device=field.device) % len(turn)]


def _turn(azimuths: Float[Tensor, " W"]) -> Float[Tensor, " W_360"] | None:
    """Azimuths of one full turn from 0° up, with the grid's step; None: there is none, or it would be more work."""
    steps = 360 / abs(float(azimuths[1])) if len(azimuths) > 1 else 0.5
    columns = round(steps)
    if abs(steps - columns) > WHOLE or columns > MOST_TURN * len(azimuths):
        return None
    return torch.arange(columns, dtype=azimuths.dtype, device=azimuths.device) * (360 / columns)


def conic_of(scale: Float[Tensor, "B N_p 2"], rotation: Float[Tensor, "B N_p"]) -> Conic:
    """The entries a, b, c of Σ⁻¹ = [[a, b], [b, c]], with Σ = R(ρ) diag(s_x², s_y²) R(ρ)ᵀ, per square degree."""
    cos, sin = rotation.cos(), rotation.sin()
    inverse_x, inverse_y = scale.pow(-2).unbind(-1)
    return (
        cos**2 * inverse_x + sin**2 * inverse_y,
        cos * sin * (inverse_x - inverse_y),
        sin**2 * inverse_x + cos**2 * inverse_y,
    )


def splat_reference(
    ordered: Ordered, azimuths: Float[Tensor, " W"], elevations: Float[Tensor, " H"]
) -> Float[Tensor, "B H W 2"]:
    """The field of primitives, each of which is evaluated at every pixel."""
    shape = gaussian(ordered.azimuth, ordered.elevation, ordered.conic, pixel_grid(azimuths, elevations))
    alpha = ordered.opacity[..., None] * shape
    field = blending_weights(alpha).mT @ ordered.coefficient  # F(p) = Σ_i c_i α_i(p) Π_{j<i} (1 − α_j(p))
    return field.unflatten(1, (len(elevations), len(azimuths)))


def gaussian(
    azimuth: Float[Tensor, "*#B N_p"], elevation: Float[Tensor, "*#B N_p"], conic: Conic, pixels: Float[Tensor, "P 2"]
) -> Float[Tensor, "B N_p P"]:
    """G_i(p) = exp(−½ (p − μ_i)ᵀ Σ_i⁻¹ (p − μ_i)) on the (φ, θ) plane.

    φ − φ_i is wrapped into [−180°, 180°), so that a primitive near azimuth 0° also covers 359°.
    """
    d_azimuth = (pixels[:, 0] - azimuth[..., None] + 180).remainder(360) - 180
    d_elevation = pixels[:, 1] - elevation[..., None]
    a, b, c = (entry[..., None] for entry in conic)
    return torch.exp(-0.5 * (a * d_azimuth**2 + 2 * b * d_azimuth * d_elevation + c * d_elevation**2))


def blending_weights(alpha: Float[Tensor, "*B N_p P"]) -> Float[Tensor, "*B N_p P"]:
    """α_i(p) Π_{j<i} (1 − α_j(p)), with the primitives in order from front to back."""
    transmittance = torch.cumprod(1 - alpha, dim=-2)
    return alpha * torch.cat([torch.ones_like(alpha[..., :1, :]), transmittance[..., :-1, :]], dim=-2)


def pixel_grid(azimuths: Float[Tensor, " W"], elevations: Float[Tensor, " H"]) -> Float[Tensor, "H*W 2"]:
    """(φ, θ) of every pixel of a grid, degrees, row by row; a row has one elevation."""
    grid_elevation, grid_azimuth = torch.meshgrid(elevations, azimuths, indexing="ij")
    return torch.stack([grid_azimuth.flatten(), grid_elevation.flatten()], dim=-1)


NEIGHBOURS = 3  # A Gaussian starts as large as its nearest neighbours are far, so that fewer ones fill the same space
LEAST_ACROSS = 1e-3  # least distance from the vertical axis for J, metres; azimuth has no derivative on the axis


def neighbour_distance(place: Float[np.ndarray, "N_p 3"]) -> Float[np.ndarray, " N_p"]:
    """Root mean square distance from each point to its nearest neighbours."""
    nearest = range(2, min(NEIGHBOURS, len(place) - 1) + 2)  # the first is the point itself
    return np.sqrt(np.square(cKDTree(place).query(place, nearest)[0]).mean(axis=1))


def rotation_matrix(quaternion: Float[Tensor, "*batch 4"]) -> Float[Tensor, "*batch 3 3"]:
    """The rotation of a quaternion (w, x, y, z) of any length but zero."""
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
    """Azimuth φ in [0, 360) and latitude λ in [−90, 90] of places seen from the origin, degrees, and d(φ, λ)/dp."""
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
    """
    first, second = axes.unbind(-2)
    wide, high = first.square().sum(-1), second.square().sum(-1)
    both = torch.linalg.cross(first, second).square().sum(-1)
    determinant = both + blur * (wide + high) + blur**2
    return (high + blur) / determinant, -(first * second).sum(-1) / determinant, (wide + blur) / determinant
