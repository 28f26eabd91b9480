"""The CUDA kernels, in Triton's interpreter where there is no GPU, against the reference in double precision."""

import math

import numpy as np
import pytest
import torch

pytest.importorskip("triton", reason="Triton comes with the CUDA builds of torch, and with bisplat-wrf[test]")

from learn.models.splatting.ordered import Ordered
from learn.models.splatting.splat import conic_of, splat_reference
from learn.models.splatting.splat_triton import splat_triton

DEVICE = "cuda" if torch.cuda.is_available() else "cpu"
AZIMUTHS, ELEVATIONS = torch.arange(0.0, 360.0, 6.0).double(), torch.arange(3.0, 90.0, 6.0).double()


def primitives(kind, count=10, batch=2):
    """Attributes in float64 and depth order: azimuth, elevation, scale, rotation, opacity, coefficient."""
    generator = np.random.default_rng(7)
    azimuth, elevation = generator.uniform(0, 360, count), generator.uniform(0, 90, count)
    scale = generator.uniform(4, 25, (batch, count, 2))
    opacity = generator.uniform(0.05, 0.95, (batch, count))
    if kind == "seam":
        azimuth[:] = np.resize([0.0, 359.999, 0.001, 358.0, 2.0], count)
    elif kind == "elevation limits":
        elevation[:] = np.resize([0.0, 90.0], count)
    elif kind == "tiny":
        scale *= 0.02
        azimuth[:3], elevation[:3] = (0.0, 120.0, 354.0), (3.0, 45.0, 87.0)
    elif kind == "huge":
        scale *= 30
    elif kind == "thin":
        scale[:] = 60.0, 2.0
    elif kind == "opaque and equal":  # one place: what is behind is hidden, and order decides
        azimuth[:5], elevation[:5], opacity[:, :5] = 120.0, 45.0, 0.999
    elif kind == "own places":
        azimuth, elevation = np.stack([azimuth, azimuth[::-1]]), np.stack([elevation, elevation[::-1]])
    elif kind == "opacity limits":
        opacity[:] = np.resize([1e-6, 1 - 1e-4], count)
    values = (
        azimuth,
        elevation,
        scale,
        generator.uniform(0, math.pi, (batch, count)),
        opacity,
        generator.normal(size=(batch, count)) + 1j * generator.normal(size=(batch, count)),
    )
    return tuple(torch.from_numpy(value) for value in values)


def rendered(renderer, values, dtype, device):
    """The field and the gradient of a fixed weighting of it."""
    complex_dtype = torch.complex64 if dtype == torch.float32 else torch.complex128
    leaves = [v.to(device, complex_dtype if v.is_complex() else dtype).clone().requires_grad_(True) for v in values]
    azimuth, elevation, scale, rotation, opacity, coefficient = leaves
    ordered = Ordered(azimuth, elevation, conic_of(scale, rotation), opacity, torch.view_as_real(coefficient))
    axes = AZIMUTHS.to(device, dtype), ELEVATIONS.to(device, dtype)
    field = renderer(ordered, *axes)
    weights = torch.from_numpy(np.random.default_rng(3).normal(size=field.shape)).to(device, dtype)
    (field * weights).sum().backward()
    return field.detach().cpu(), [leaf.grad.cpu() for leaf in leaves]


@pytest.mark.parametrize(
    "kind",
    ["any", "seam", "elevation limits", "tiny", "huge", "thin", "opaque and equal", "own places", "opacity limits"],
)
def test_values_and_gradients_are_those_of_the_reference(kind):
    values = primitives(kind)
    expected, expected_gradients = rendered(splat_reference, values, torch.float64, "cpu")
    found, found_gradients = rendered(splat_triton, values, torch.float32, DEVICE)
    most = values[-1].abs().sum()
    assert expected.abs().max() > 1e-3 * most  # there is something to see
    assert (found - expected).abs().max() < 1e-5 * most
    for one, other in zip(found_gradients, expected_gradients, strict=True):
        assert (one - other).abs().max() < 1e-4 * max(other.abs().max().item(), 1e-3)
