"""GSRF against its equations, written once more Gaussian by Gaussian."""

import math

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation
from scipy.special import lpmv

from learn.models.peers.gsrf import DEGREE, GSRF, legendre_fourier
from simulate.spectra.beamformer import Beamformer

POSITIONS = torch.tensor([[0.5, 0.0, 1.0], [3.0, -0.7, 2.2]])
AZIMUTH, ELEVATION = 100, 40  # The pixel that is computed by hand, degrees


@pytest.fixture
def make(region):
    def build(**settings) -> GSRF:
        torch.manual_seed(0)
        return GSRF(region, Beamformer(), 0.33, **{"primitives": 30, **settings})

    return build


def terms(direction) -> list[complex]:
    """The expansion's terms of one direction, by SciPy's associated Legendre functions."""
    x, y, z = direction
    found = []
    for degree in range(DEGREE + 1):
        for m in range(-degree, degree + 1):
            n = abs(m)
            scale = (2 * degree + 1) / (4 * math.pi) * math.factorial(degree - n) / math.factorial(degree + n)
            value = math.sqrt(scale) * lpmv(n, degree, z) * np.exp(1j * m * math.atan2(y, x))
            found.append(value * (-1) ** n if m < 0 else value)
    return found


def test_terms_are_those_of_legendre_functions():
    directions = np.random.default_rng(0).normal(size=(20, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    found = legendre_fourier(torch.from_numpy(directions), DEGREE).numpy()
    np.testing.assert_allclose(found, [terms(each) for each in directions], atol=1e-10)


def test_a_pixel_is_the_blend_of_complex_signals_from_front_to_back(make):
    model = make()
    with torch.no_grad():
        model.attenuation_raw += 0.6  # opaque enough that those in front hide those behind
        model.scale_raw -= 2.0
        model.quaternion += 0.4 * torch.randn(30, 4)
        model.scale_raw += 0.5 * torch.randn(30, 3)
        found = model(POSITIONS)[:, ELEVATION, AZIMUTH].tolist()
    expected = [by_hand(model, position.double().numpy()) for position in POSITIONS]
    assert found == pytest.approx(expected, rel=1e-3)
    assert found[0] != pytest.approx(found[1], rel=0.02)


def by_hand(model, position) -> float:
    parameters = {name: each.detach().double().numpy() for name, each in model.named_parameters()}
    away = 0.8 * parameters["place"] - (position - model.region.double().mean(dim=0).numpy())
    total, passed = 0.0, 1.0
    for i in np.argsort(np.linalg.norm(away, axis=1)):
        far = np.linalg.norm(away[i])
        if far <= 1.5 * 0.307 or away[i][2] <= 0:
            continue
        unit = away[i] / far
        rotation = Rotation.from_quat(parameters["quaternion"][i], scalar_first=True).as_matrix()
        covariance = rotation @ np.diag(np.exp(2 * 0.5 * parameters["scale_raw"][i])) @ rotation.T
        across = math.hypot(unit[0], unit[1])
        east, up = (
            np.array([-unit[1], unit[0], 0]) / across,
            np.array([-unit[0] * unit[2], -unit[1] * unit[2], across**2]),
        )
        turn = (AZIMUTH - math.degrees(math.atan2(unit[1], unit[0])) + 180) % 360 - 180
        rise = ELEVATION - math.degrees(math.asin(unit[2]))
        difference = 0.307 * (math.radians(turn) * across * east + math.radians(rise) * up / across)
        opacity = 1 / (1 + math.exp(-4.2 * parameters["attenuation_raw"][i]))
        alpha = opacity * math.exp(-0.5 * difference @ np.linalg.solve(covariance, difference))
        paces = np.array([1.0] + [0.193] * 99)
        signal = np.array(terms(unit)) @ (paces * (parameters["coefficients"][i] @ [1, 1j]))
        total += passed * alpha * signal
        passed *= 1 - alpha
    return math.sqrt(abs(total) ** 2 + 1e-8)


def test_its_loss_has_a_term_of_fourier_transforms(make):
    model, truth = make(), torch.rand(2, 90, 360)
    with torch.no_grad():
        predicted = model(POSITIONS)
        spread = torch.fft.fft2(predicted - truth, norm="ortho").abs().square().mean()
        same = make()
        same.forward = lambda positions: predicted
        found = same.training_loss(POSITIONS, truth)
        l1 = (predicted - truth).abs().mean()
        from pytorch_msssim import ssim

        dissimilarity = 1 - ssim(predicted[None], truth[None], data_range=1.0)
    expected = (1 - 0.366 - 0.1915) * l1 + 0.366 * dissimilarity + 0.1915 * spread
    torch.testing.assert_close(found, expected, rtol=1e-4, atol=1e-6)


def test_a_turn_of_everything_turns_the_picture_also_over_the_seam(make):
    model = make()
    with torch.no_grad():
        model.region.copy_(torch.tensor([[-1.0, -1, -1], [1, 1, 1]]))
        model.scale_raw -= 3.0
        model.coefficients[:, 1:] = 0  # signals that are the same in all directions
        before = model(POSITIONS)
        for points in (model.place, turned := POSITIONS.clone()):
            x, y, z = points.clone().unbind(-1)
            points.copy_(torch.stack([-y, x, z], dim=-1))
        torch.testing.assert_close(model(turned), before.roll(90, dims=2), rtol=1e-3, atol=1e-4)
    assert (before[:, :, :1] - before[:, :, 180:181]).abs().max() > 1e-4


def test_it_is_finite_where_a_gaussian_is_at_the_transmitter_or_above_it(make):
    model = make()
    with torch.no_grad():
        model.place[0] = (POSITIONS[0] - model.region.mean(dim=0)) / 0.8
        model.place[1] = model.place[0] + torch.tensor([0.0, 0.0, 3.0])
    model.training_loss(POSITIONS, torch.rand(2, 90, 360)).backward()
    assert all(each.grad.isfinite().all() for each in model.parameters())
