"""Positions that several pictures share: repeated measurements are taken, mixed frequencies or gateways are not."""

import numpy as np
import pytest

from simulate.dataset.oddities import oddities
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.identification import Identification
from simulate.spectra.spectrum import picture

PLACES = np.array([[0.0, 0, 1], [0.4, 0, 1], [0.8, 0.3, 1]])


@pytest.fixture
def look(tmp_path):
    """Function: responses of nine pictures, whose places repeat -> problems and warnings of the folder."""

    def oddities_of(responses, places=PLACES):
        found = oddities(
            np.resize(places, (9, 3)), picture(Beamformer().spectrum(responses)), Identification(), tmp_path
        )
        return found.problems, found.warnings

    return oddities_of


def normal(*shape: int) -> np.ndarray:
    return np.random.default_rng(0).normal(size=(*shape, 16, 2)) @ np.array([1, 1j])


@pytest.mark.parametrize("noise", [0.0, 0.1])
def test_repeated_measurements_are_a_warning(look, noise):
    responses = np.tile(normal(3), (3, 1)) + noise * normal(9)
    assert look(responses) == ([], ["9 of 9 pictures share their position with another picture"])


def test_different_pictures_of_a_position_are_a_problem(look):
    """As in a folder that mixes frequencies."""
    (problem,), _ = look(normal(9))
    assert "expected one picture for each position, found 9 pictures of 3 positions; does the folder mix" in problem


def test_one_position_is_a_problem(look):
    (problem,), _ = look(normal(9), PLACES[:1])
    assert "expected positions that differ, found [0.0, 0.0, 1.0] for all 9" in problem
