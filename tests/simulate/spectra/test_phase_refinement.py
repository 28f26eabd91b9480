"""Least squares for responses: the derivatives are true, and the offset is found with the responses."""

import numpy as np

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
