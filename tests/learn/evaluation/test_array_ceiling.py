"""The array's ceiling: recorded responses are the best ones, others are found behind the pictures."""

import numpy as np
import pytest

from learn.quantities import array_ceiling as module
from learn.quantities.array_ceiling import array_ceiling
from simulate.spectra.spectrum import normalise, picture, spectrum_of
from tests.plane_wave_field import BEAMFORMER, plane_waves

RESPONSES = plane_waves(np.random.default_rng(0).uniform(0, 1, (3, 3)), 20, 1)
PICTURES = spectrum_of(picture(BEAMFORMER.spectrum(RESPONSES)))


def test_recorded_responses_are_not_found_again(monkeypatch):
    monkeypatch.setattr(module, "retrieve_responses", lambda *_: pytest.fail("found behind the pictures"))
    found = array_ceiling(PICTURES, BEAMFORMER, RESPONSES)
    np.testing.assert_allclose(found, normalise(BEAMFORMER.spectrum(RESPONSES)))


def test_responses_that_do_not_explain_their_picture_are_found_behind_it():
    wrong = RESPONSES.copy()
    wrong[1] = RESPONSES[2]
    found = array_ceiling(PICTURES, BEAMFORMER, wrong)
    assert np.abs(found - PICTURES).max() < 0.02
