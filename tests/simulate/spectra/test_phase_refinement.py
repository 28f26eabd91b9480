"""Least squares for responses: the derivatives are true, and the offset is found with the responses."""

import numpy as np
import pytest

from simulate.spectra.angular_grid import AngularGrid
from simulate.spectra.array import PlanarArray
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.phase_refinement import SpatialFrequencies, _Linearised, refined

FREQUENCIES = SpatialFrequencies.of(Beamformer(PlanarArray(3, 4)), 6)
SEEN = int(FREQUENCIES.seen.sum())
RANDOM = np.random.default_rng(1)
UNKNOWNS = RANDOM.standard_normal((2, 25))
MAGNITUDE = RANDOM.random((2, SEEN))


def test_changes_of_the_residuals_are_their_derivatives():
    change, small = RANDOM.standard_normal((2, 25)), 1e-5
    ahead, behind = (_Linearised.at(UNKNOWNS + sign * small * change, MAGNITUDE, FREQUENCIES) for sign in (1, -1))
    by_difference = (ahead.error - behind.error) / (2 * small)
    here = _Linearised.at(UNKNOWNS, MAGNITUDE, FREQUENCIES)
    np.testing.assert_allclose(here.along(change), by_difference, atol=1e-5)


def test_the_transpose_belongs_to_the_jacobian():
    here = _Linearised.at(UNKNOWNS, MAGNITUDE, FREQUENCIES)
    change, residuals = RANDOM.standard_normal((2, 25)), RANDOM.standard_normal((2, SEEN))
    forward, back = here.along(change) * residuals, change * here.transposed(residuals)
    np.testing.assert_allclose(forward.sum(axis=1), back.sum(axis=1))


def test_responses_and_offsets_are_found_from_near_by():
    truth, offset = RANDOM.standard_normal((4, 3, 4, 2)) @ [1, 1j], np.array([0.0, 0.1, 0.2, 0.3])
    magnitude = np.abs(FREQUENCIES.beams(truth)) - offset[:, None, None]
    start = truth + 0.05 * RANDOM.standard_normal((4, 3, 4, 2)) @ [1, 1j]
    found, found_offset = refined(start, magnitude, FREQUENCIES)
    np.testing.assert_allclose(found_offset, offset, atol=1e-3)
    np.testing.assert_allclose(
        np.abs(FREQUENCIES.beams(found.reshape(4, 3, 4))), np.abs(FREQUENCIES.beams(truth)), atol=5e-3
    )


BEAMFORMERS = [
    Beamformer(),
    Beamformer(PlanarArray(3, 5, 0.7), AngularGrid(1.0)),
    Beamformer(PlanarArray(8, 8, 0.4), AngularGrid(10.0, 0.5, 0.5)),
]


def responses(beamformer: Beamformer, count: int = 3) -> np.ndarray:
    array = beamformer.array
    return np.random.default_rng(1).standard_normal((count, array.rows, array.columns, 2)) @ [1, 1j]


@pytest.mark.parametrize("beamformer", BEAMFORMERS)
def test_beams_are_those_of_the_steering_vectors(beamformer):
    grid = beamformer.grid
    frequencies, y = SpatialFrequencies.of(beamformer, 4), responses(beamformer)
    azimuth = np.radians(grid.azimuth_step_deg * frequencies.column)
    elevation = np.radians(grid.elevation_first_deg + grid.elevation_step_deg * frequencies.row)
    seen = frequencies.seen
    steering = beamformer.array.manifold(azimuth[seen], elevation[seen]).conj() / np.sqrt(beamformer.array.elements)
    wanted = np.abs(y.reshape(len(y), -1) @ steering.T)
    np.testing.assert_allclose(np.abs(frequencies.beams(y))[:, seen], wanted, atol=1e-9)
    np.testing.assert_allclose(frequencies.responses(frequencies.beams(y)), y, atol=1e-9)


@pytest.mark.parametrize("beamformer", BEAMFORMERS)
def test_spectra_are_sampled_at_the_frequencies(beamformer):
    frequencies, y = SpatialFrequencies.of(beamformer, 4), responses(beamformer)
    sampled = frequencies.sampled(beamformer.spectrum(y.reshape(len(y), -1)))
    seen = frequencies.seen
    assert 0.1 < seen.mean() < 1
    np.testing.assert_allclose(sampled[:, seen], np.abs(frequencies.beams(y))[:, seen], atol=0.02)
    assert not sampled[:, ~seen].any()


def test_directions_outside_the_grid_are_not_seen():
    above_45 = SpatialFrequencies.of(Beamformer(grid=AngularGrid(45.0, 0.5)), 8)
    half_circle = SpatialFrequencies.of(Beamformer(grid=AngularGrid(azimuth_step_deg=0.5)), 8)
    whole = SpatialFrequencies.of(Beamformer(), 8)
    assert 0.4 < above_45.seen.sum() / whole.seen.sum() < 0.6  # cos² 45° of the disk
    assert 0.45 < half_circle.seen.sum() / whole.seen.sum() < 0.6
