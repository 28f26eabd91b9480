"""The search finds places from any likelihood: broad or narrow, in a volume, a plane or along a line."""

import numpy as np
import pytest

from learn.localisation.evidence import Evidence
from learn.localisation.located_places import Located
from learn.localisation.picture_evidence import PictureEvidence
from learn.localisation.place_search import MODES, Grid, candidate_points, grid_in, grid_warning, search

WAVELENGTH = 0.32
BOX = np.array([[-1.0, -1, -1], [1, 1, 1]])


class Normal(Evidence):
    """Normal densities: what is heard of a transmitter is the means of equally probable places."""

    most = 20_000

    def __init__(self, means, deviation, region=BOX, known=None):
        super().__init__(np.asarray(means, float), region, WAVELENGTH, known)
        self.deviation = np.broadcast_to(deviation, 3)

    told = property(lambda self: np.isfinite(self.heard).all(axis=(1, 2)))

    def log_likelihood(self, points, heard):
        for means in heard:
            off = (points[:, None] - means) / self.deviation
            yield np.logaddexp.reduce(-np.square(off).sum(axis=2) / 2, axis=1)

    def misfit(self, points, row):
        return np.zeros(len(points))


@pytest.mark.parametrize("deviation", [0.2, 0.05, 0.004, 1e-4])
def test_a_normal_density_is_found_whether_it_is_wider_or_narrower_than_the_grid(deviation):
    (places,) = search(Normal([[[0.113, -0.217, 0.309]]], deviation))
    assert len(places) == 1
    np.testing.assert_allclose(places[0].position, [0.113, -0.217, 0.309], atol=0.05 * deviation)
    cell = 0.04**2 / 12 if deviation > 0.04 else 0
    np.testing.assert_allclose(places[0].covariance, (deviation**2 + cell) * np.eye(3), atol=0.15 * deviation**2)


def test_two_places_far_apart_stay_two_and_near_ones_become_one():
    two, one, none = search(Normal([[[-0.6, 0, 0], [0.6, 0, 0]], [[-0.1, 0, 0], [0.1, 0, 0]], [[np.nan] * 3] * 2], 0.1))
    assert [place.probability for place in two] == pytest.approx([0.5, 0.5], abs=0.01)
    assert sorted(place.position[0] for place in two) == pytest.approx([-0.6, 0.6], abs=0.01)
    assert len(one) == 1 and one[0].covariance[0, 0] == pytest.approx(0.02, rel=0.15) and none == []


def test_on_a_slanted_line_of_known_positions_the_places_are_on_it():
    """A grid in the box alone has no point near enough to a line on which the transmitter is known to be."""
    line = np.linspace(-1, 1, 30)[:, None] * [0.9, 0.5, 0.3]
    ((place,),) = search(Normal([[line[11]]], 0.1, known=line))
    np.testing.assert_allclose(np.cross(place.position, line[0]), 0, atol=1e-9)
    np.testing.assert_allclose(place.position, line[11], atol=0.01)
    assert np.linalg.matrix_rank(place.covariance, tol=1e-9) == 1


def test_half_of_the_errors_in_a_plane_are_in_regions_of_half():
    """The share in regions is right for normal errors, and an axis without extent does not count."""
    truth = np.zeros((400, 3))
    heard = np.random.default_rng(0).normal(0, [0.05, 0.05, 0], (400, 1, 3))
    flat = np.array([[-1.0, -1, 0], [1, 1, 0]])
    found = Located(search(Normal(heard, 0.05, flat)), [""] * 400, [""] * 400, truth)
    assert found.share_in_region == pytest.approx(0.9, abs=0.05)
    assert not any(place.covariance[2].any() for places in found for place in places)


class Pictured(PictureEvidence):
    """Fingerprints that a function predicts, of 8 independent numbers and without a prior."""

    numbers, most = 8.0, 3000

    def __init__(self, predicted, seen, region):
        Evidence.__init__(self, seen, region, WAVELENGTH)
        self._predicted = predicted


def test_a_known_picture_is_found_at_its_own_place_with_a_small_deviation():
    """Interpolation by inverse distances is flat at each known position, but steep around it."""
    known = 0.16 * (np.stack(np.meshgrid(*[np.arange(3)] * 3), axis=-1).reshape(-1, 3) - 1.0)

    def predicted(positions):
        weights = 1 / np.maximum(((positions[:, None] - known) ** 2).sum(axis=2), 1e-12)
        return weights / weights.sum(axis=1, keepdims=True)

    place = search(Pictured(predicted, np.eye(27)[[13]], 0.3 * BOX))[0][0]
    assert np.linalg.norm(place.position) < 1e-3
    assert np.sqrt(np.trace(place.covariance)) < 0.02  # no wavelength, as a flat field alone would say


def test_in_a_flat_region_the_height_is_no_unknown():
    """The fingerprint says as much of x + z as of y. At the known height, x is told as exactly as y."""
    goal = np.array([[0.03, -0.02, 0.0]])

    def predicted(positions):
        some = 0.5 * np.stack([positions[:, 0] + positions[:, 2], positions[:, 1]], axis=1)
        return np.column_stack([some, np.sqrt(1 - np.square(some).sum(axis=1))])

    place = search(Pictured(predicted, predicted(goal), BOX * [1, 1, 0]))[0][0]
    np.testing.assert_allclose(place.position, goal[0], atol=1e-3)
    assert not place.covariance[2].any() and not place.covariance[:, 2].any()
    assert place.covariance[0, 0] == pytest.approx(place.covariance[1, 1], rel=0.01)


def test_grid_keeps_the_corners_and_the_number_of_points():
    region = np.array([[0.0, 0, 0], [1, 2, 0]])
    points = grid_in(region, 0.04, 10_000)
    np.testing.assert_array_equal([points.min(axis=0), points.max(axis=0)], region)
    steps = [np.diff(np.unique(axis)).max(initial=0) for axis in points.T]
    assert max(steps) < 0.0401 and len(np.unique(points, axis=0)) == len(points)
    assert len(grid_in(np.array([[0.0, 0, 0], [1e4, 1e4, 1e-3]]), 0.04, 1000)) < 1501


def test_starts_are_apart():
    points = grid_in(np.array([[0.0, 0, 0], [1, 1, 1]]), 0.1, 2000)
    starts = candidate_points(points, -np.linalg.norm(points - 0.5, axis=1), 0.3)
    np.testing.assert_allclose(starts[0], [0.5, 0.5, 0.5])
    apart = np.linalg.norm(starts[:, None] - starts, axis=-1) + 9 * np.eye(MODES)
    assert apart.min() >= 0.3


def test_a_large_region_is_warned_of():
    evidence = Normal([[[0, 0, 0]]], 0.1)
    assert grid_warning(evidence) is None and Grid(evidence).spacing < 0.08
    evidence.most = 50
    assert "wavelengths apart" in grid_warning(evidence)
