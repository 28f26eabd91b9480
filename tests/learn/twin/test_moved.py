"""A scene that changed a little keeps the chains found before, unless surfaces of one plane have come apart."""

import numpy as np
import pytest

from learn.twin.linearised import moved
from scenes.scene.description import SceneObject
from scenes.scene.shapes import box
from simulate.rays.core.propagation import Propagation
from simulate.rays.tracer import Tracer
from tests.small_scene import small_scene

POSITIONS = np.random.default_rng(0).uniform((2.0, -0.5, 1.0), (3.0, 0.5, 1.6), (5, 3))


def two_boxes(apart):
    """The small scene with two metal boxes whose fronts lie in one plane, but for a distance in metres."""
    left = SceneObject("left", box((1.0, 1.5, 0.001), (2.0, 2.0, 3.0)), "metal")
    right = SceneObject("right", box((2.5, 1.5 + apart, 0.001), (3.5, 2.0 + apart, 3.0)), "metal")
    return small_scene(left, right)


@pytest.mark.parametrize("diffraction", [False, True])
@pytest.mark.parametrize("apart", [0.0, 0.005])
def test_moved_scene_has_the_paths_of_a_new_one(apart, diffraction):
    propagation = Propagation(max_depth=2, rays=20_000, diffraction=diffraction)
    tracer = moved(Tracer(two_boxes(0.0), propagation), two_boxes(apart), small_scene().transmitter.region)
    expected = Tracer(two_boxes(apart), propagation).responses(POSITIONS)
    np.testing.assert_allclose(tracer.responses(POSITIONS), expected, atol=1e-5 * np.abs(expected).max())
