"""The models ours are compared with: against their equations, written once more without vectors."""

import cmath
import math

import numpy as np
import pytest
import torch

from learn.models.encoding import positional_encoding
from learn.models.peers.nerf2 import FAR, ORDER, PATH_LOSS, NeRF2
from learn.models.peers.swiftwrf import SwiftWRF
from learn.models.quadrature import picture_pixels
from simulate.spectra.beamformer import Beamformer

POSITIONS = torch.tensor([[0.5, 0.0, 1.0], [3.0, -0.7, 2.2]])


@pytest.fixture
def make(region):
    def build(model, **settings):
        torch.manual_seed(0)
        return model(region, Beamformer(), 0.33, **settings)

    return build


def test_swiftwrf_is_the_magnitude_of_the_sum_of_its_deformed_gaussians(make):
    """One pixel, Gaussian by Gaussian; no depth, so one behind others is seen like one before them."""
    model = make(SwiftWRF, primitives=12)
    azimuth, elevation = 100, 40
    with torch.no_grad():
        model.coefficient[:3] *= -1  # so that something is clipped at 0
        model.cholesky[:, 1] -= 0.5
        found = model(POSITIONS)[:, elevation, azimuth].tolist()
        changes = model.deformation(model.place.tanh(), POSITIONS - model.region.mean(dim=0))
        factors = (model.cholesky + torch.tensor([0.5, 0, 0.5])) * math.sqrt(10_000 / 12)
    assert changes[0].abs().max() > 1e-3
    for sample in range(2):
        total = np.zeros(2)
        for number in range(12):
            move, fade, change = (each[sample, number].double().numpy() for each in changes)
            across, up = np.tanh(model.place[number].detach().double().numpy() + move)
            x = np.array([(azimuth - 180 * (across + 1) + 180) % 360 - 180, elevation - 45 * (up + 1)])
            corner, slope, end = factors[number].tolist()
            whitened = np.linalg.solve([[corner, 0], [slope, end]], x)
            opacity = model.opacity[number].item() + fade[0]
            coefficient = model.coefficient[number].detach().double().numpy() + change
            total += opacity * coefficient * math.exp(-0.5 * whitened @ whitened)
        assert found[sample] == pytest.approx(np.linalg.norm(total.clip(0, 1)), rel=1e-4)


def test_swiftwrf_fills_the_spectrum_alike_with_fewer_gaussians(make):
    means = []
    for count in (300, 3000):
        model = make(SwiftWRF, primitives=count)
        with torch.no_grad():
            for head in model.deformation.heads:
                head[-1].weight.zero_()
                head[-1].bias.zero_()
            means.append(model(POSITIONS).mean().item())
    assert means[0] == pytest.approx(means[1], rel=0.1)


def test_nerf2_marches_rays_by_its_equations(make):
    """One pixel, voxel by voxel, in complex numbers."""
    model = make(NeRF2, samples=5, width=8)
    few = picture_pixels(Beamformer())
    row, column = few.rows[6], few.columns[10]
    with torch.no_grad():
        direction = model.directions[6 * len(few.columns) + 10]
        attenuation, feature = model.voxels(direction[None])
        low, high = model.region
        scaled = 2 * (POSITIONS - low) / (high - low) - 1
        encoded = [positional_encoding(part, ORDER).expand(5, -1) for part in (direction, scaled[0])]
        raw = model.field.signal(
            torch.nn.functional.linear(torch.cat([feature[0], *encoded], -1), *_weights(model.field.radiance))
        )
        found = model(POSITIONS)[0, row, column].item()
    elevation, azimuth = math.radians(row), math.radians(column)
    expected_direction = [
        math.cos(elevation) * math.cos(azimuth),
        math.cos(elevation) * math.sin(azimuth),
        math.sin(elevation),
    ]
    np.testing.assert_allclose(direction.numpy(), expected_direction, atol=1e-6)
    step, received, passed = FAR / 4, 0, 1
    for n in range(5):
        signal = abs(raw[n, 0].item()) * cmath.exp(1j * 2 * math.pi * _sigmoid(raw[n, 1].item()))
        received += PATH_LOSS / (step * (n + 1)) * passed * signal
        delta, psi = abs(attenuation[0, n, 0].item()), 2 * math.pi * _sigmoid(attenuation[0, n, 1].item())
        passed *= cmath.exp((-delta + 1j * psi) * step)
    assert found == pytest.approx(abs(received), rel=1e-4)


def test_nerf2_loss_is_that_of_its_rays(make):
    """With a prediction that is right everywhere it is zero, with one that is off by a tenth it is a hundredth."""
    model = make(NeRF2, samples=3, width=8, rays=500)
    with torch.no_grad():
        pictures = model(POSITIONS)
        assert model.training_loss(POSITIONS, pictures).item() == pytest.approx(0, abs=1e-10)
        assert model.training_loss(POSITIONS, pictures + 0.1).item() == pytest.approx(0.01, rel=1e-3)


def _weights(layer):
    return layer.weight, layer.bias


def _sigmoid(x):
    return 1 / (1 + math.exp(-x))
