"""Depth-ordered splatting of complex coefficients on the (φ, θ) plane, azimuth periodic.

``splat_reference`` reads like the equations; ``splat`` gives the same by the fastest way for the tensors' device.
Complex numbers are pairs (real, imaginary) along the last axis, which every compiler and exporter understands.
"""

from __future__ import annotations

from typing import NamedTuple

import torch
from jaxtyping import Float
from torch import Tensor

from learn.models.splat_cpu import splat_cpu


class Splats(NamedTuple):
    """Primitives as they are blended for transmitters: the first arguments of ``splat``. Degrees; ρ in radians."""

    azimuth: Float[Tensor, " N_p"]
    elevation: Float[Tensor, " N_p"]
    depth: Float[Tensor, " N_p"]
    scale: Float[Tensor, "B N_p 2"]
    rotation: Float[Tensor, "B N_p"]
    opacity: Float[Tensor, "B N_p"]
    coefficient: Float[Tensor, "B N_p 2"]


def splat(
    azimuth: Float[Tensor, " N_p"],
    elevation: Float[Tensor, " N_p"],
    depth: Float[Tensor, " N_p"],
    scale: Float[Tensor, "B N_p 2"],
    rotation: Float[Tensor, "B N_p"],
    opacity: Float[Tensor, "B N_p"],
    coefficient: Float[Tensor, "B N_p 2"],
    azimuths: Float[Tensor, " W"],
    elevations: Float[Tensor, " H"],
) -> Float[Tensor, "B H W 2"]:
    """The complex field F(φ, θ) = Σ_i c_i α_i Π_{j<i} (1 − α_j), α_i = o_i G_i(φ, θ), nearer primitives first.

    Args:
        azimuth: φ_i, degrees, in [0, 360).
        elevation: θ_i, degrees.
        depth: d_i; equal depths keep the order they are given in.
        scale: standard deviations (s_x, s_y) along the rotated axes, degrees.
        rotation: ρ_i, radians.
        opacity: o_i in (0, 1).
        coefficient: c_i, real and imaginary part.
        azimuths: the grid's columns, once round from 0° in equal steps.
        elevations: the grid's rows, degrees.
    """
    order = torch.argsort(depth, stable=True)
    azimuth, elevation = azimuth[order], elevation[order]
    conic = conic_of(scale[:, order], rotation[:, order])
    opacity, coefficient = opacity[:, order], coefficient[:, order]
    if torch.compiler.is_exporting():
        renderer = splat_reference  # operators that any runtime knows
    elif azimuth.device.type == "cpu":
        renderer = splat_cpu
    elif azimuth.device.type == "cuda":
        from learn.models.splat_triton import splat_triton as renderer  # Triton comes with torch's CUDA builds only
    else:
        renderer = splat_reference
    return renderer(azimuth, elevation, conic, opacity, coefficient, azimuths, elevations)


def conic_of(scale: Float[Tensor, "B N_p 2"], rotation: Float[Tensor, "B N_p"]) -> tuple[Tensor, Tensor, Tensor]:
    """a, b, c of Σ⁻¹ = [[a, b], [b, c]], Σ = R(ρ) diag(s_x², s_y²) R(ρ)ᵀ."""
    cos, sin = rotation.cos(), rotation.sin()
    inverse_x, inverse_y = scale.pow(-2).unbind(-1)
    return (
        cos**2 * inverse_x + sin**2 * inverse_y,
        cos * sin * (inverse_x - inverse_y),
        sin**2 * inverse_x + cos**2 * inverse_y,
    )


def splat_reference(
    azimuth: Float[Tensor, " N_p"],
    elevation: Float[Tensor, " N_p"],
    conic: tuple[Float[Tensor, "B N_p"], Float[Tensor, "B N_p"], Float[Tensor, "B N_p"]],
    opacity: Float[Tensor, "B N_p"],
    coefficient: Float[Tensor, "B N_p 2"],
    azimuths: Float[Tensor, " W"],
    elevations: Float[Tensor, " H"],
) -> Float[Tensor, "B H W 2"]:
    """The equations for primitives in depth order, every primitive at every pixel: simple, slow, and large."""
    alpha = opacity[..., None] * gaussian(azimuth, elevation, conic, pixel_grid(azimuths, elevations))
    return blend(alpha, coefficient).unflatten(1, (len(elevations), len(azimuths)))


def gaussian(
    azimuth: Float[Tensor, " N_p"],
    elevation: Float[Tensor, " N_p"],
    conic: tuple[Float[Tensor, "B N_p"], Float[Tensor, "B N_p"], Float[Tensor, "B N_p"]],
    pixels: Float[Tensor, "P 2"],
) -> Float[Tensor, "B N_p P"]:
    """G_i(p) = exp(−½ (p − μ_i)ᵀ Σ_i⁻¹ (p − μ_i)) on the chart with periodic azimuth.

    A primitive near 0° also covers 359°: φ − φ_i is taken in [−180°, 180°).
    """
    d_azimuth = (pixels[:, 0] - azimuth[:, None] + 180).remainder(360) - 180
    d_elevation = pixels[:, 1] - elevation[:, None]
    a, b, c = (entry[..., None] for entry in conic)
    return torch.exp(-0.5 * (a * d_azimuth**2 + 2 * b * d_azimuth * d_elevation + c * d_elevation**2))


def blend(alpha: Float[Tensor, "B N_p P"], coefficient: Float[Tensor, "B N_p 2"]) -> Float[Tensor, "B P 2"]:
    """F(p) = Σ_i c_i α_i(p) Π_{j<i} (1 − α_j(p)), primitives front to back; real and imaginary part alike."""
    transmittance = torch.cumprod(1 - alpha, dim=1)
    transmittance = torch.cat([torch.ones_like(alpha[:, :1]), transmittance[:, :-1]], dim=1)
    return (alpha * transmittance).transpose(1, 2) @ coefficient


def pixel_grid(azimuths: Float[Tensor, " W"], elevations: Float[Tensor, " H"]) -> Float[Tensor, "H*W 2"]:
    """(φ, θ) of every pixel of a grid, row by row (a row has one elevation), degrees."""
    grid_elevation, grid_azimuth = torch.meshgrid(elevations, azimuths, indexing="ij")
    return torch.stack([grid_azimuth.flatten(), grid_elevation.flatten()], dim=-1)
