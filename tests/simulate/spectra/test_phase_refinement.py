"""Least squares for responses: the derivatives are true, and the offset is found with the responses."""

import numpy as np
import pytest

from simulate.spectra.angular_grid import AngularGrid
from simulate.spectra.array import PlanarArray
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.phase_refinement import refined
from simulate.spectra.phase_retrieval import SpatialFrequencies
from tests.simulate.spectra.random_spectra import random_responses

RANDOM = np.random.default_rng(1)


def test_responses_and_offsets_are_found_from_near_by():
    steering = Beamformer(PlanarArray(3, 4)).steering[::5, ::9].reshape(-1, 12)
    truth, offset = RANDOM.standard_normal((4, 12, 2)) @ [1, 1j], np.array([0.0, 0.1, 0.2, 0.3])
    magnitude = np.abs(truth @ steering.T) - offset[:, None]
    start = truth + 0.05 * RANDOM.standard_normal((4, 12, 2)) @ [1, 1j]
    found, found_offset = refined(start, magnitude, steering)
    np.testing.assert_allclose(found_offset, offset, atol=1e-3)
    np.testing.assert_allclose(np.abs(found @ steering.T), np.abs(truth @ steering.T), atol=5e-3)


BEAMFORMERS = [
    Beamformer(),
    Beamformer(PlanarArray(3, 5, 0.7), AngularGrid(1.0)),
    Beamformer(PlanarArray(8, 8, 0.4), AngularGrid(10.0, 0.5, 0.5)),
]


@pytest.mark.parametrize("beamformer", BEAMFORMERS)
def test_beams_at_spatial_frequencies_are_those_of_the_nearest_pixels(beamformer):
    array, frequencies = beamformer.array, SpatialFrequencies.of(beamformer, 4)
    flat, seen = random_responses(3, array.elements, seed=1), frequencies.seen
    y = flat.reshape(3, array.rows, array.columns)
    np.testing.assert_allclose(frequencies.responses(frequencies.beams(y)), y, atol=1e-9)
    sampled, beams = frequencies.sampled(beamformer.spectrum(flat)), np.abs(frequencies.beams(y))
    assert 0.1 < seen.mean() < 1 and not sampled[:, ~seen].any()
    assert np.abs(sampled - beams)[:, seen].max() < 0.05 * beams.max()


def test_directions_outside_the_grid_are_not_seen():
    above_45 = SpatialFrequencies.of(Beamformer(grid=AngularGrid(45.0, 0.5)), 8)
    half_circle = SpatialFrequencies.of(Beamformer(grid=AngularGrid(azimuth_step_deg=0.5)), 8)
    whole = SpatialFrequencies.of(Beamformer(), 8)
    assert 0.4 < above_45.seen.sum() / whole.seen.sum() < 0.6  # cos² 45° of the disk
    assert 0.45 < half_circle.seen.sum() / whole.seen.sum() < 0.6
