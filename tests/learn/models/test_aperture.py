"""BiSplat-aperture against the array's equations, the renderer and two plane waves."""

import copy

import numpy as np
import pytest
import torch

from learn.data.metrics import ssim
from learn.models.networks.aperture import STEP_DEG, BiSplatAperture
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.spectrum import normalise

POSITIONS = torch.tensor([[0.5, 0.0, 1.0], [3.0, -0.7, 2.2]])
WAVELENGTH = 0.33


def make_aperture(size, region, beamformer=None):
    torch.manual_seed(0)
    return BiSplatAperture(region, beamformer or Beamformer(), WAVELENGTH, **size)


def test_responses_begin_at_a_magnitude_of_about_one(region):
    model = make_aperture({}, region)
    places = torch.rand(200, 3) * torch.tensor([4.0, 2.0, 2.0]) + torch.tensor([0.0, -1.0, 0.5])
    with torch.no_grad():
        assert 0.2 < model.responses(places).square().sum(dim=-1).mean() < 5


def test_responses_are_the_sum_over_all_directions(small_aperture, region):
    """y_m = Σ a_m F cosθ ΔφΔθ, a_m = e^{j2π(x cosθ cosφ + y cosθ sinφ)}, looped over directions and elements."""
    model = make_aperture(small_aperture, region)
    with torch.no_grad():
        pairs = model.field(POSITIONS), model.responses(POSITIONS)
    field, found = (torch.view_as_complex(pair.contiguous()).numpy() for pair in pairs)
    azimuths, elevations = np.radians(model.azimuths.numpy()), np.radians(model.elevations.numpy())
    step = np.radians(STEP_DEG)
    np.testing.assert_allclose(np.diff(azimuths), step, rtol=1e-4)
    np.testing.assert_allclose(np.diff(elevations), step, rtol=1e-4)
    expected = np.zeros((2, 16), complex)
    for m in range(16):
        x, y = (m % 4 - 1.5) / 2, (m // 4 - 1.5) / 2  # wavelengths, x running fastest
        for row, theta in enumerate(elevations):
            for column, phi in enumerate(azimuths):
                across = np.cos(theta) * (x * np.cos(phi) + y * np.sin(phi))
                weight = np.exp(2j * np.pi * across) * np.cos(theta) * step**2
                expected[:, m] += weight * field[:, row, column]
    np.testing.assert_allclose(found, expected, atol=1e-4 * np.abs(expected).max())


def test_constant_field_gives_the_integral_over_the_half_sphere(small_aperture, region):
    """∫ e^{jk u·d} dΩ over the half-sphere above the plane of d is 2π sin(k|d|) / (k|d|)."""
    model = make_aperture(small_aperture, region)
    index = np.arange(16)
    across = 2 * np.pi * np.hypot(index % 4 - 1.5, index // 4 - 1.5) / 2
    of_constant_field = model.aperture.sum(dim=0)  # F = 1 in all directions
    real, imaginary = of_constant_field.unflatten(-1, (-1, 2)).numpy().T
    np.testing.assert_allclose(real, 2 * np.pi * np.sin(across) / across, atol=0.005 * 2 * np.pi)
    np.testing.assert_allclose(imaginary, 0, atol=0.005 * 2 * np.pi)


def test_aperture_learns_the_responses_to_two_plane_waves(plane_waves, small_aperture, region):
    responses = plane_waves((1, 200, 40), (0.6j, 60, 25))
    model = make_aperture(small_aperture, region)
    truth = torch.view_as_real(torch.from_numpy(responses))[None].float()
    optimiser = torch.optim.Adam(model.parameters(), 1e-2)
    for _ in range(120):
        optimiser.zero_grad()
        model.responses_loss(POSITIONS[:1], truth).backward()
        optimiser.step()
    with torch.no_grad():
        spectrum = model(POSITIONS[:1]).double().numpy()
    assert ssim(spectrum, normalise(Beamformer().spectrum(responses))[None])[0] > 0.99


@pytest.mark.parametrize("one_field", [False, True])
def test_what_is_kept_for_predictions_follows_the_weights(small_aperture, region, one_field):
    model = make_aperture(small_aperture, region)
    if one_field:
        model.sample_one_field(torch.eye(3))

    def predicted(model):
        with torch.inference_mode():
            kept = [model.responses(POSITIONS) for _ in range(2)][1]
        with torch.no_grad():
            torch.testing.assert_close(kept, model.responses(POSITIONS), atol=1e-5, rtol=1e-5)
        return kept

    before = predicted(model)
    with torch.no_grad():
        model.primitives.rotation.add_(0.5)
    turned = predicted(model)
    assert (turned - before).abs().max() > 1e-4
    model.load_state_dict(make_aperture(small_aperture, region).state_dict(), strict=False)
    torch.testing.assert_close(predicted(model), before, atol=1e-5, rtol=1e-5)
    torch.testing.assert_close(predicted(copy.deepcopy(model)), before, atol=1e-5, rtol=1e-5)
    assert len(model._kept) == (2 if one_field else 1)
