"""A tour is short, and goes round walls."""

from itertools import permutations

import numpy as np
import pytest

from learn.planning.tour import short_tour
from scenes.scene.description import SceneObject
from scenes.scene.shapes import sheet
from tests.small_scene import small_scene

WALL = SceneObject("wall", sheet((2.5, -0.5, 0), (0, 0.8, 0), (0, 0, 3)), "concrete")
"""Through the region at x = 2.5, with a way round it at y above 0.3."""


def length(points: np.ndarray) -> float:
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


def test_tour_is_near_the_shortest_of_all():
    points = np.random.default_rng(0).random((7, 3))
    found = short_tour(points)
    assert sorted(found.order) == list(range(7)) and found.crossings == 0
    assert found.length == pytest.approx(length(points[found.order]))
    assert found.length < 1.05 * min(length(points[list(order)]) for order in permutations(range(7)))


@pytest.mark.parametrize("count", [1, 2, 60])
def test_tour_is_no_longer_than_the_given_order(count):
    points = np.random.default_rng(count).random((count, 3))
    assert short_tour(points).length <= length(points) + 1e-9
    along = points[np.argsort(points[:, 0])] * [1, 0, 0]
    assert short_tour(along).length == pytest.approx(np.ptp(points[:, 0]))


def test_tour_goes_round_a_wall():
    """Pairs face each other across the wall; one pair is beside its end."""
    y = np.array([-0.4, -0.2, 0.0, 0.4])
    points = np.array([[x, each, 1.3] for each in y for x in (2.45, 2.55)])
    assert short_tour(points, small_scene()).length == pytest.approx(1.2)
    found = short_tour(points, small_scene(WALL))
    assert found.crossings == 0 and found.length == pytest.approx(1.7)


def test_lines_that_have_to_cross_are_counted():
    points = np.array([[2.2, -0.3, 1.2], [2.8, -0.3, 1.2], [2.2, -0.2, 1.2], [2.8, -0.2, 1.2]])
    assert short_tour(points, small_scene(WALL)).crossings == 1
