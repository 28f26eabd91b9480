"""Responses found from spectra are the ones the spectra were made of, up to what a magnitude cannot tell."""

import numpy as np
import pytest

from simulate.spectra import phase_retrieval
from simulate.spectra.array import PlanarArray
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.phase_retrieval import GOOD, retrieve_responses
from simulate.spectra.spectrum import normalise, picture, spectrum_of


def likeness(found: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """Correlation of responses up to a common phase and the flip y_m -> conj y_{MN−1−m}, of which the better counts."""
    found, truth = (each / np.linalg.norm(each, axis=1, keepdims=True) for each in (found, truth))
    return np.max([np.abs((found.conj() * each).sum(axis=1)) for each in (truth, truth[:, ::-1].conj())], axis=0)


@pytest.mark.parametrize(
    ("rows", "columns", "spacing"), [(4, 4, 0.5), (3, 4, 0.47), (2, 2, 0.5), (4, 4, 0.35), (4, 4, 1.0), (6, 6, 0.5)]
)
def test_responses_are_found_again(rows, columns, spacing):
    array = PlanarArray(rows, columns, spacing)
    beamformer = Beamformer(array)
    truth = np.random.default_rng(1).standard_normal((6, array.elements, 2)) @ [1, 1j]
    found = retrieve_responses(normalise(beamformer.spectrum(truth)), beamformer)
    assert found.residual.max() < 0.05  # grey levels; the spectra are interpolated
    assert likeness(found.responses, truth).min() > 0.99999


def test_pictures_of_eight_bits_are_reproduced_to_their_rounding():
    beamformer = Beamformer()
    truth = np.random.default_rng(2).standard_normal((6, 16, 2)) @ [1, 1j]
    spectra = spectrum_of(picture(beamformer.spectrum(truth)))
    found = retrieve_responses(spectra, beamformer)
    assert found.residual.max() < 0.35
    assert likeness(found.responses, truth).min() > 0.999
    again = normalise(beamformer.spectrum(found.responses))
    assert np.abs(again - spectra).max() < 3 / 255


def test_responses_of_a_large_array_are_found_again():
    beamformer = Beamformer(PlanarArray(8, 8))
    directions = np.random.default_rng(5).integers((90, 360), size=(4, 12, 2))
    strength = np.random.default_rng(6).standard_normal((4, 12, 2)) @ [1, 1j]
    waves = beamformer.steering[directions[..., 0], directions[..., 1]].conj()
    truth = (strength[..., None] * waves).sum(axis=1)
    found = retrieve_responses(spectrum_of(picture(beamformer.spectrum(truth))), beamformer)
    assert found.residual.max() < GOOD
    assert likeness(found.responses, truth).min() > 0.98  # the rounding hides beams outside the hemisphere


def test_phase_and_flip_do_not_depend_on_where_the_search_began():
    truth = np.random.default_rng(3).standard_normal((6, 16, 2)) @ [1, 1j]
    first, second = (retrieve_responses(normalise(Beamformer().spectrum(truth)), Beamformer(), seed) for seed in (1, 2))
    np.testing.assert_allclose(first.responses, second.responses, atol=0.01)


def test_a_spectrum_of_another_array_is_doubtful():
    other = Beamformer(PlanarArray(8, 8))
    spectra = normalise(other.spectrum(np.random.default_rng(4).standard_normal((1, 64, 2)) @ [1, 1j]))
    assert retrieve_responses(spectra, Beamformer()).residual[0] > 10 * GOOD


@pytest.mark.filterwarnings("error")
def test_elements_that_are_very_close_together_are_no_error(monkeypatch):
    monkeypatch.setattr(phase_retrieval, "MOST_STEPS", 960)  # nothing is found, however long it looks
    beamformer = Beamformer(PlanarArray(spacing=0.01))
    spectra = normalise(beamformer.spectrum(np.random.default_rng(7).standard_normal((2, 16, 2)) @ [1, 1j]))
    assert np.isfinite(retrieve_responses(spectra, beamformer).residual).all()
