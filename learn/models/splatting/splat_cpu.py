"""The reference renderer as a compiled loop on the CPU: for each row of pixels, over the primitives from front to back.

A primitive is visited only where its Gaussian exceeds ``CUTOFF``, and two multiplications per pixel (forward
differences) replace its exponential. The backward pass goes over the rows again. With the gradient g of the loss at a
pixel, the transmittance T_i in front of primitive i, and w_i = T_i α_i, the pixel's contribution S = Re(ḡ F) has

    ∂S/∂α_i = T_i Re(ḡ c_i) − (Σ_{k>i} w_k Re(ḡ c_k)) / (1 − α_i)

The sum over those behind i is the sum over all of them, which the field gives, minus that over i and those in front.
"""

from __future__ import annotations

import math

import numba
import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from learn.models.splatting.ordered import Ordered
from simulate.parallel.compiled import ONE_KERNEL, compiled

CUTOFF = 1e-8
"""A primitive is left out where its Gaussian is below this; the field's error is below CUTOFF · Σ|o_i c_i|."""

LEVEL = -2 * math.log(CUTOFF)  # squared Mahalanobis distance at which a Gaussian equals ``CUTOFF``


@compiled(inline="always")
def _span(d_elevation, azimuth, a, b, c, step):
    """Columns first … last of a row in which G ≥ CUTOFF, and the forward differences of G from the first column on."""
    level = LEVEL - (c - b * b / a) * d_elevation * d_elevation
    if level < 0:
        return 0, -1, 0.0, 0.0, 0.0
    half = math.sqrt(level / a)
    middle = -b * d_elevation / a
    # φ − φ_i is wrapped into [−180°, 180°).
    low, high = max(middle - half, -180.0), min(middle + half, 180.0)
    first = math.ceil((azimuth + low) / step)
    last = math.floor((azimuth + high) / step)
    if last * step - azimuth >= 180.0:
        last -= 1
    d_azimuth = first * step - azimuth
    start = a * d_azimuth * d_azimuth + 2 * b * d_azimuth * d_elevation + c * d_elevation * d_elevation
    growth = a * (2 * d_azimuth * step + step * step) + 2 * b * step * d_elevation
    return first, last, math.exp(-0.5 * start), math.exp(-0.5 * growth), math.exp(-a * step * step)


@compiled(parallel=True)
def _forward(azimuth, elevation, a, b, c, opacity, real, imaginary, rows, columns, step):
    batch, count = a.shape
    field = np.zeros((batch, len(rows), columns, 2))
    for task in numba.prange(batch * len(rows)):
        sample, row = task // len(rows), task % len(rows)
        transmittance = np.ones(columns)
        for i in range(count):
            d_elevation = rows[row] - elevation[sample, i]
            first, last, value, ratio, change = _span(
                d_elevation, azimuth[sample, i], a[sample, i], b[sample, i], c[sample, i], step
            )
            column = first % columns
            for _ in range(first, last + 1):
                alpha = opacity[sample, i] * value
                weight = transmittance[column] * alpha
                field[sample, row, column, 0] += weight * real[sample, i]
                field[sample, row, column, 1] += weight * imaginary[sample, i]
                transmittance[column] *= 1 - alpha
                value *= ratio
                ratio *= change
                column = column + 1 if column + 1 < columns else 0
    return field


@compiled(parallel=True)
def _backward(azimuth, elevation, a, b, c, opacity, real, imaginary, rows, columns, step, field, gradient, groups):
    batch, count = a.shape
    # Each task has its own sums, which are added up at the end. The result therefore does not depend on the order in
    # which parallel tasks run.
    sums = np.zeros((batch * groups, 8, count))
    for task in numba.prange(batch * groups):
        sample, group = task // groups, task % groups
        for row in range(group, len(rows), groups):
            transmittance = np.ones(columns)
            behind = np.empty(columns)
            for column in range(columns):
                behind[column] = (
                    gradient[sample, row, column, 0] * field[sample, row, column, 0]
                    + gradient[sample, row, column, 1] * field[sample, row, column, 1]
                )
            for i in range(count):
                d_elevation = rows[row] - elevation[sample, i]
                a_i, b_i, c_i, o_i = a[sample, i], b[sample, i], c[sample, i], opacity[sample, i]
                first, last, value, ratio, change = _span(d_elevation, azimuth[sample, i], a_i, b_i, c_i, step)
                if last < first:
                    continue
                column = first % columns
                s_real = s_imaginary = s_opacity = s_0 = s_1 = s_2 = 0.0
                for position in range(first, last + 1):
                    d_azimuth = position * step - azimuth[sample, i]
                    alpha = o_i * value
                    weight = transmittance[column] * alpha
                    g_real, g_imaginary = gradient[sample, row, column, 0], gradient[sample, row, column, 1]
                    share = g_real * real[sample, i] + g_imaginary * imaginary[sample, i]
                    behind[column] -= weight * share
                    d_alpha = transmittance[column] * share - behind[column] / max(1 - alpha, 1e-12)
                    s_real += weight * g_real
                    s_imaginary += weight * g_imaginary
                    s_opacity += d_alpha * value
                    d_exponent = -0.5 * d_alpha * alpha
                    s_0 += d_exponent
                    s_1 += d_exponent * d_azimuth
                    s_2 += d_exponent * d_azimuth * d_azimuth
                    transmittance[column] *= 1 - alpha
                    value *= ratio
                    ratio *= change
                    column = column + 1 if column + 1 < columns else 0
                sums[task, 0, i] -= 2 * (a_i * s_1 + b_i * d_elevation * s_0)
                sums[task, 1, i] -= 2 * (b_i * s_1 + c_i * d_elevation * s_0)
                sums[task, 2, i] += s_2
                sums[task, 3, i] += 2 * d_elevation * s_1
                sums[task, 4, i] += d_elevation * d_elevation * s_0
                sums[task, 5, i] += s_opacity
                sums[task, 6, i] += s_real
                sums[task, 7, i] += s_imaginary
    return sums


class _Splat(torch.autograd.Function):
    @staticmethod
    def forward(ctx, azimuth, elevation, a, b, c, opacity, real, imaginary, rows, columns, step):
        attributes = [x.detach().double().contiguous() for x in (azimuth, elevation, a, b, c, opacity, real, imaginary)]
        arrays = [x.numpy() for x in attributes]
        with ONE_KERNEL:
            field = _forward(*arrays, rows, columns, step)  # type: ignore[call-arg]
        ctx.save_for_backward(*attributes)
        ctx.field, ctx.grid = field, (rows, columns, step)
        return torch.from_numpy(field).to(real.dtype)

    @staticmethod
    def backward(ctx, gradient):
        attributes = ctx.saved_tensors
        batch, count = attributes[2].shape
        groups = max(1, math.ceil(2 * torch.get_num_threads() / batch))
        upstream = gradient.double().contiguous().numpy()
        arrays = [x.numpy() for x in attributes]
        with ONE_KERNEL:
            sums = _backward(*arrays, *ctx.grid, ctx.field, upstream, groups)  # type: ignore[call-arg]
        parts = torch.from_numpy(sums.reshape(batch, groups, 8, count).sum(axis=1)).to(gradient.dtype)
        return *parts.unbind(1), None, None, None


def splat_cpu(
    ordered: Ordered, azimuths: Float[Tensor, " W"], elevations: Float[Tensor, " H"]
) -> Float[Tensor, "B H W 2"]:
    """As ``splat_reference``, in double precision, with the cut-off ``CUTOFF``, of azimuths that make one turn."""
    columns = len(azimuths)
    return _Splat.apply(*ordered.attributes(), elevations.double().numpy(), columns, 360.0 / columns)
