"""Factors and flips of responses, found again such that the responses are one field."""

import numpy as np
import pytest

from learn.models.kriging.retrieved_field import flipped, synchronised
from simulate.spectra.beamformer import Beamformer

WAVELENGTH = 0.33
RATIO = 0.01  # Variance of the noise relative to that of the field


@pytest.fixture(scope="module")
def field():
    """Positions [n, 3] in a box of 1.5 wavelengths, and responses [n, 16] to six waves, each from one direction at the
    transmitter and another at the array."""
    generator = np.random.default_rng(2)
    positions = generator.uniform(0, 1.5 * WAVELENGTH, (150, 3))
    departing = generator.standard_normal((6, 3))
    departing /= np.linalg.norm(departing, axis=1, keepdims=True)
    amplitudes = generator.standard_normal((6, 2)) @ [1, 1j]
    arriving = Beamformer().array.manifold(generator.uniform(0, 2 * np.pi, 6), generator.uniform(0.2, 1.4, 6))
    waves = np.exp(2j * np.pi / WAVELENGTH * positions @ departing.T)
    return positions, waves @ (amplitudes[:, None] * arriving)


@pytest.fixture
def covariance(field):
    """That of waves from all directions: sin(kd) / kd."""
    positions, _ = field

    def between(a, b):
        distance = np.linalg.norm(positions[a][:, None] - positions[b], axis=-1)
        return np.sinc(2 * distance / WAVELENGTH).astype(complex)

    return between


def likeness(a, b):
    return abs(np.vdot(a, b)) / np.linalg.norm(a) / np.linalg.norm(b)


def test_field_is_found_up_to_a_flip_and_a_factor_of_all(field, covariance):
    positions, truth = field
    generator = np.random.default_rng(0)
    factors = generator.standard_normal((len(truth), 2)) @ [1, 1j]
    turned = np.where(generator.random(len(truth))[:, None] < 0.5, truth, flipped(truth)) * factors[:, None]
    found = synchronised(turned, positions, covariance, RATIO)
    assert likeness(turned, truth) < 0.5
    assert max(likeness(found, truth), likeness(flipped(found), truth)) > 0.98
    assert np.square(np.abs(found)).mean() == pytest.approx(1)


def test_flipped_responses_have_the_same_spectrum(field):
    _, truth = field
    beamformer = Beamformer()
    np.testing.assert_allclose(beamformer.spectrum(flipped(truth[:3])), beamformer.spectrum(truth[:3]), atol=1e-9)
