"""Beams at spatial frequencies are those of the beamformer, and spectra are sampled where their pixels lie."""

import numpy as np
import pytest

from simulate.spectra.angular_grid import AngularGrid
from simulate.spectra.array import PlanarArray
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.phase_refinement import SpatialFrequencies

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
