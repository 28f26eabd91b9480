"""Errors of known spectra that are predicted from those farther away."""

import numpy as np
import pytest

from learn.models.kriging.helmholtz import HelmholtzField
from learn.models.networks.mlp import SpectrumMLP
from learn.training.conformal_deviation import errors_over_gaps, knowing_nothing
from tests.plane_wave_field import BEAMFORMER, WAVELENGTH, dataset_of, plane_waves

POSITIONS = np.random.default_rng(3).uniform(0, 0.6, (80, 3))
REGION = np.array([[0.0, 0.0, 0.0], [0.6, 0.6, 0.6]])
EVERY = np.arange(80)


@pytest.fixture(scope="module")
def dataset():
    return dataset_of(POSITIONS, plane_waves(POSITIONS, 60, 4))


@pytest.fixture(scope="module")
def field(dataset):
    model = HelmholtzField(REGION, BEAMFORMER, WAVELENGTH)
    model.fit(dataset, EVERY)
    return model.eval()


def test_a_field_that_interpolates_states_its_own_errors_and_keeps_its_spectra(field, dataset):
    before = {name: buffer.clone() for name, buffer in field.state_dict().items()}
    found = errors_over_gaps(field, dataset, EVERY)
    assert found.over == "variance" and (np.diff(found.curve()[1]) >= 0).all()
    near, far = found.gap < np.quantile(found.gap, 0.2), found.gap > np.quantile(found.gap, 0.8)
    assert found.error[far].mean() > 3 * found.error[near].mean()
    for name, buffer in field.state_dict().items():
        assert (buffer == before[name]).all(), name


def test_kriging_stands_for_a_network(field, dataset):
    found = errors_over_gaps(SpectrumMLP(REGION, BEAMFORMER, WAVELENGTH), dataset, EVERY)
    assert found.over == "distance" and found.gap.min() > 0.01
    own = errors_over_gaps(field, dataset, EVERY)
    assert np.median(found.error) == pytest.approx(np.median(own.error), rel=0.3)


def test_too_few_spectra_tell_nothing(field, dataset):
    assert errors_over_gaps(field, dataset, EVERY[:8]) is None


def test_knowing_nothing_is_the_difference_of_unrelated_spectra():
    places = np.array([[0.0, 0, 0], [5.0, 0, 0], [5.1, 0, 0]])
    dataset = dataset_of(places, plane_waves(places, 60, 4))
    black = np.zeros((1, 90, 360), np.float32)
    # The only spectra a wavelength away or more are the other two.
    expected = np.quantile(dataset.spectra[1:, ::5, ::5], 0.9) / 1.6449
    assert knowing_nothing(black, places[:1], dataset, np.arange(3)) == pytest.approx(expected, rel=1e-3)
