"""Depth-ordered splatting of complex coefficients on the (φ, θ) plane, azimuth periodic: the reference renderer."""

from __future__ import annotations

import torch
from jaxtyping import Complex, Float
from torch import Tensor
from torch.utils.checkpoint import checkpoint

PIXELS_AT_ONCE = 1024
"""Pixels blended together: keeps one intermediate of a batch of 8 and 500 primitives at 16 MB."""


def gaussian(
    azimuth: Float[Tensor, " N_p"],
    elevation: Float[Tensor, " N_p"],
    scale: Float[Tensor, "B N_p 2"],
    rotation: Float[Tensor, "B N_p"],
    pixels: Float[Tensor, "P 2"],
) -> Float[Tensor, "B N_p P"]:
    """G_i(p) = exp(−½ (p − μ_i)ᵀ Σ_i⁻¹ (p − μ_i)), Σ = R(ρ) diag(s²) R(ρ)ᵀ, on the chart with periodic azimuth.

    A primitive near 0° also covers 359°: φ − φ_i is taken in [−180°, 180°).
    """
    d_azimuth = (pixels[:, 0] - azimuth[:, None] + 180).remainder(360) - 180
    d_elevation = pixels[:, 1] - elevation[:, None]
    cos, sin = rotation.cos(), rotation.sin()
    inverse_x, inverse_y = scale.pow(-2).unbind(-1)
    # Σ⁻¹ = [[a, b], [b, c]]
    a = cos**2 * inverse_x + sin**2 * inverse_y
    b = cos * sin * (inverse_x - inverse_y)
    c = sin**2 * inverse_x + cos**2 * inverse_y
    exponent = a[..., None] * d_azimuth**2
    exponent = exponent + 2 * b[..., None] * (d_azimuth * d_elevation)
    exponent = exponent + c[..., None] * d_elevation**2
    return torch.exp(-0.5 * exponent)


def blend(alpha: Float[Tensor, "B N_p P"], coefficient: Complex[Tensor, "B N_p"]) -> Complex[Tensor, "B P"]:
    """C(p) = Σ_i c_i α_i(p) Π_{j<i} (1 − α_j(p)), primitives front to back; real and imaginary part alike."""
    transmittance = torch.cumprod(1 - alpha, dim=1)
    transmittance = torch.cat([torch.ones_like(alpha[:, :1]), transmittance[:, :-1]], dim=1)
    parts = torch.view_as_real(coefficient.resolve_conj()).transpose(1, 2)  # B 2 N_p
    return torch.view_as_complex((parts @ (alpha * transmittance)).transpose(1, 2).contiguous())


def splat(
    azimuth: Float[Tensor, " N_p"],
    elevation: Float[Tensor, " N_p"],
    depth: Float[Tensor, " N_p"],
    scale: Float[Tensor, "B N_p 2"],
    rotation: Float[Tensor, "B N_p"],
    opacity: Float[Tensor, "B N_p"],
    coefficient: Complex[Tensor, "B N_p"],
    pixels: Float[Tensor, "P 2"],
) -> Complex[Tensor, "B P"]:
    """The complex field F at each pixel; nearer primitives hide farther ones.

    Args:
        azimuth: φ_i, degrees.
        elevation: θ_i, degrees.
        depth: d_i; equal depths keep the order they are given in.
        scale: standard deviations (s_x, s_y) along the rotated axes, degrees.
        rotation: ρ_i, radians.
        opacity: o_i in (0, 1).
        coefficient: c_i.
        pixels: (φ, θ) of each pixel, degrees.
    """
    order = torch.argsort(depth, stable=True)
    sorted_attributes = (
        azimuth[order],
        elevation[order],
        scale[:, order],
        rotation[:, order],
        opacity[:, order],
        coefficient[:, order],
    )

    def some_pixels(azimuth, elevation, scale, rotation, opacity, coefficient, pixels):
        return blend(opacity[..., None] * gaussian(azimuth, elevation, scale, rotation, pixels), coefficient)

    pieces = pixels.split(PIXELS_AT_ONCE)
    if len(pieces) == 1:
        return some_pixels(*sorted_attributes, pixels)
    # Backward blends each piece anew instead of keeping hundreds of megabytes per spectrum.
    return torch.cat(
        [checkpoint(some_pixels, *sorted_attributes, piece, use_reentrant=False) for piece in pieces], dim=1
    )


def pixel_grid(azimuths: Float[Tensor, " W"], elevations: Float[Tensor, " H"]) -> Float[Tensor, "H*W 2"]:
    """(φ, θ) of every pixel of a grid, row by row (a row has one elevation), degrees."""
    grid_elevation, grid_azimuth = torch.meshgrid(elevations, azimuths, indexing="ij")
    return torch.stack([grid_azimuth.flatten(), grid_elevation.flatten()], dim=-1)
