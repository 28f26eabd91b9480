"""The reference renderer as Triton kernels for CUDA; a program blends one tile of pixels, from front to back.

The backward kernel goes over the primitives again and writes one gradient per tile and primitive, which are added up in
a fixed order. Without a GPU, Triton's interpreter can run the same code, as in the tests.
"""

from __future__ import annotations

import torch
import triton
import triton.language as tl
from jaxtyping import Float
from torch import Tensor

from learn.models.splatting.ordered import Ordered
from learn.models.splatting.splat_cpu import LEVEL

TILE_ROWS, TILE_COLUMNS = 8, 32


@triton.jit
def _tile(rows, height, width, step, TILE_ROWS: tl.constexpr, TILE_COLUMNS: tl.constexpr):
    """The tile of this program: offsets of its pixels in a field, whether they are inside it, angles, and bounds."""
    across = tl.cdiv(width, TILE_COLUMNS)
    tile = tl.program_id(0)
    row = (tile // across) * TILE_ROWS + tl.arange(0, TILE_ROWS)
    column = (tile % across) * TILE_COLUMNS + tl.arange(0, TILE_COLUMNS)
    theta = tl.load(rows + row, mask=row < height, other=0.0)
    phi = column.to(tl.float32) * step
    inside = (row < height)[:, None] & (column < width)[None, :]
    offset = row[:, None] * width + column[None, :]
    low = tl.min(tl.where(row < height, theta, 1e9))
    high = tl.max(tl.where(row < height, theta, -1e9))
    half = 0.5 * step * (TILE_COLUMNS - 1)
    middle = (tile % across) * TILE_COLUMNS * step + half
    return offset, inside, phi, theta, low, high, middle, half


@triton.jit
def _wrapped(angle):
    """The angle in [−180°, 180°)."""
    return angle - 360.0 * tl.floor((angle + 180.0) / 360.0)


@triton.jit
def _reaches(azimuth, elevation, own, low, high, middle, half):
    """Whether a primitive's ellipse G = CUTOFF overlaps the tile."""
    overlaps_azimuth = tl.abs(_wrapped(middle - azimuth)) <= half + tl.load(own + 6)
    elevation_reach = tl.load(own + 7)
    return overlaps_azimuth & (elevation + elevation_reach >= low) & (elevation - elevation_reach <= high)


@triton.jit
def _gaussian(azimuth, elevation, a, b, c, phi, theta):
    """Offsets of the tile's pixels from a primitive's centre, and its Gaussian there."""
    d_azimuth, d_elevation = _wrapped(phi - azimuth)[None, :], (theta - elevation)[:, None]
    exponent = a * d_azimuth * d_azimuth + 2 * b * d_azimuth * d_elevation + c * d_elevation * d_elevation
    return d_azimuth, d_elevation, tl.exp(-0.5 * exponent)


@triton.jit
def _forward(
    attributes, rows, field, count, height, width, step,
    TILE_ROWS: tl.constexpr, TILE_COLUMNS: tl.constexpr,
):  # fmt: skip
    offset, inside, phi, theta, low, high, middle, half = _tile(rows, height, width, step, TILE_ROWS, TILE_COLUMNS)
    sample = tl.program_id(1)
    transmittance = tl.full((TILE_ROWS, TILE_COLUMNS), 1.0, tl.float32)
    real = tl.zeros((TILE_ROWS, TILE_COLUMNS), tl.float32)
    imaginary = tl.zeros((TILE_ROWS, TILE_COLUMNS), tl.float32)
    for i in range(count):
        own = attributes + (sample * count + i) * 10
        azimuth, elevation = tl.load(own + 8), tl.load(own + 9)
        if _reaches(azimuth, elevation, own, low, high, middle, half):
            a, b, c = tl.load(own), tl.load(own + 1), tl.load(own + 2)
            _, _, value = _gaussian(azimuth, elevation, a, b, c, phi, theta)
            alpha = tl.load(own + 3) * value
            weight = transmittance * alpha
            real += weight * tl.load(own + 4)
            imaginary += weight * tl.load(own + 5)
            transmittance *= 1 - alpha
    address = field + 2 * (sample * height * width + offset)
    tl.store(address, real, mask=inside)
    tl.store(address + 1, imaginary, mask=inside)


@triton.jit
def _backward(
    attributes, rows, field, gradient, shares, count, height, width, step,
    TILE_ROWS: tl.constexpr, TILE_COLUMNS: tl.constexpr,
):  # fmt: skip
    offset, inside, phi, theta, low, high, middle, half = _tile(rows, height, width, step, TILE_ROWS, TILE_COLUMNS)
    sample = tl.program_id(1)
    address = 2 * (sample * height * width + offset)
    g_real = tl.load(gradient + address, mask=inside, other=0.0)
    g_imaginary = tl.load(gradient + address + 1, mask=inside, other=0.0)
    behind = g_real * tl.load(field + address, mask=inside, other=0.0)
    behind += g_imaginary * tl.load(field + address + 1, mask=inside, other=0.0)
    transmittance = tl.full((TILE_ROWS, TILE_COLUMNS), 1.0, tl.float32)
    for i in range(count):
        own = attributes + (sample * count + i) * 10
        azimuth, elevation = tl.load(own + 8), tl.load(own + 9)
        if _reaches(azimuth, elevation, own, low, high, middle, half):
            a, b, c = tl.load(own), tl.load(own + 1), tl.load(own + 2)
            d_azimuth, d_elevation, value = _gaussian(azimuth, elevation, a, b, c, phi, theta)
            alpha = tl.load(own + 3) * value
            weight = transmittance * alpha
            # ∂S/∂α_i of splat_cpu: share = Re(ḡ c_i), and behind is the sum over the primitives behind.
            share = g_real * tl.load(own + 4) + g_imaginary * tl.load(own + 5)
            behind -= weight * share
            d_alpha = transmittance * share - behind / tl.maximum(1 - alpha, 1e-6)
            d_exponent = tl.where(inside, -0.5 * d_alpha * alpha, 0.0)
            transmittance *= 1 - alpha
            out = shares + ((sample * tl.num_programs(0) + tl.program_id(0)) * count + i) * 8
            tl.store(out, -2 * tl.sum(d_exponent * (a * d_azimuth + b * d_elevation)))
            tl.store(out + 1, -2 * tl.sum(d_exponent * (b * d_azimuth + c * d_elevation)))
            tl.store(out + 2, tl.sum(d_exponent * d_azimuth * d_azimuth))
            tl.store(out + 3, 2 * tl.sum(d_exponent * d_azimuth * d_elevation))
            tl.store(out + 4, tl.sum(d_exponent * d_elevation * d_elevation))
            tl.store(out + 5, tl.sum(tl.where(inside, d_alpha * value, 0.0)))
            tl.store(out + 6, tl.sum(weight * g_real))
            tl.store(out + 7, tl.sum(weight * g_imaginary))


class _Splat(torch.autograd.Function):
    @staticmethod
    def forward(ctx, azimuth, elevation, a, b, c, opacity, real, imaginary, rows, columns):
        # Half the extent of the ellipse G = CUTOFF in azimuth and in elevation, degrees.
        determinant = a * c - b * b
        reaches = (LEVEL * c / determinant).sqrt(), (LEVEL * a / determinant).sqrt()
        numbers = a, b, c, opacity, real, imaginary, *reaches, azimuth, elevation
        attributes = torch.stack(numbers, dim=-1).float().contiguous()
        rows = rows.float().contiguous()
        (batch, count, _), height = attributes.shape, len(rows)
        field = torch.empty(batch, height, columns, 2, device=a.device)
        grid = (triton.cdiv(height, TILE_ROWS) * triton.cdiv(columns, TILE_COLUMNS), batch)
        sizes = count, height, columns, 360.0 / columns, TILE_ROWS, TILE_COLUMNS
        _forward[grid](attributes, rows, field, *sizes)
        ctx.save_for_backward(attributes, rows, field)
        ctx.grid, ctx.sizes = grid, sizes
        return field

    @staticmethod
    def backward(ctx, gradient):
        attributes, rows, field = ctx.saved_tensors
        (batch, count, _), tiles = attributes.shape, ctx.grid[0]
        shares = torch.zeros(batch, tiles, count, 8, device=field.device)
        _backward[ctx.grid](attributes, rows, field, gradient.float().contiguous(), shares, *ctx.sizes)
        return *shares.sum(dim=1).unbind(-1), None, None


def splat_triton(
    ordered: Ordered, azimuths: Float[Tensor, " W"], elevations: Float[Tensor, " H"]
) -> Float[Tensor, "B H W 2"]:
    """As ``splat_reference``, in single precision, with the cut-off ``CUTOFF``, of azimuths that make one turn."""
    return _Splat.apply(*ordered.attributes(), elevations, len(azimuths))
