"""Quick spectra are those of the beamformer, for every kind of array and grid, at every number of spectra."""

import numba
import numpy as np
import pytest

from simulate.spectra import compiled_beamformer as module
from simulate.spectra.angular_grid import AngularGrid
from simulate.spectra.array import PlanarArray
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.compiled_beamformer import compiled_beamformer
from simulate.spectra.element_array import ElementArray
from simulate.spectra.spectrum import normalise
from tests.simulate.spectra.random_spectra import random_responses

FREQUENCY = 2.4e9
ARRAYS = [
    *(PlanarArray(1, 1), PlanarArray(1, 8), PlanarArray(5, 1, 0.7), PlanarArray(), PlanarArray(3, 6, 1.3)),
    ElementArray.circle(7, 0.08).at(FREQUENCY),
    ElementArray(np.random.default_rng(1).uniform(-0.1, 0.1, (6, 3)) * [1, 1, 0]).at(FREQUENCY),
    ElementArray(np.random.default_rng(3).uniform(-0.06, 0.06, (12, 3))).at(FREQUENCY),
]


def responses_of(array, count):
    return random_responses(count, array.elements).astype(np.complex64)


def written(beamformer, responses, dtype=np.float32):
    spectra = np.full((len(responses), 90, 360), 77, dtype)
    assert compiled_beamformer(beamformer).write(responses, spectra).all()
    return spectra


GRIDS = [AngularGrid(1.0), AngularGrid(89.0, -1.0), AngularGrid(5.0, 0.8, -1.0)]
BEAMFORMERS = [*map(Beamformer, ARRAYS), *(Beamformer(PlanarArray(2, 3), grid) for grid in GRIDS)]


@pytest.mark.parametrize("beamformer", BEAMFORMERS)
def test_they_are_those_of_the_beamformer(beamformer):
    responses = responses_of(beamformer.array, 3)
    expected = normalise(beamformer.spectrum(responses.astype(complex)))
    expected = expected if beamformer.array.elements > 1 else np.zeros((3, 90, 360))
    np.testing.assert_allclose(written(beamformer, responses), expected, atol=2e-6)


def test_other_azimuths_have_no_mirror_images():
    assert compiled_beamformer(Beamformer(grid=AngularGrid(azimuth_step_deg=0.5))) is None


@pytest.mark.parametrize("count", [0, 1, 5, module.TASK + 1, 3 * module.TASK - 2])
def test_any_number_of_spectra_on_several_threads(count, monkeypatch):
    monkeypatch.setattr(numba, "get_num_threads", lambda: 3)
    beamformer = Beamformer()
    responses = responses_of(beamformer.array, count)
    one_by_one = [written(beamformer, each[None]) for each in responses]
    expected = np.concatenate([np.empty((0, 90, 360)), *one_by_one])
    np.testing.assert_allclose(written(beamformer, responses), expected, atol=2e-6)


def test_grey_levels_are_the_rounded_numbers():
    beamformer = Beamformer()
    responses = responses_of(beamformer.array, 6)
    numbers, levels = written(beamformer, responses), written(beamformer, responses, np.uint8)
    assert levels.min() == 0 and levels.max() == 255
    assert np.abs(levels - 255 * numbers).max() < 0.5 + 1e-4


def test_scale_has_no_effect_down_to_the_weakest_links():
    beamformer = Beamformer()
    responses = responses_of(beamformer.array, 2)
    for scale in (1e-30, 1e-12, 1e30):
        scaled = (scale * responses.astype(complex)).astype(np.complex64)
        np.testing.assert_allclose(written(beamformer, scaled), written(beamformer, responses), atol=1e-6)


def test_responses_of_zero_are_black_and_others_that_are_not_finite_are_named():
    beamformer = Beamformer()
    responses = responses_of(beamformer.array, 4)
    responses[1], responses[2, 3], responses[3, 0] = 0, np.nan, 1j * np.inf
    for dtype in (np.float32, np.uint8):
        spectra = np.full((4, 90, 360), 77, dtype)
        assert compiled_beamformer(beamformer).write(responses, spectra).tolist() == [True, True, False, False]
        assert not spectra[1].any() and spectra[0].max() == (1 if dtype == np.float32 else 255)
        assert np.isnan(spectra[2:]).all() if dtype == np.float32 else not spectra[2:].any()
