"""Responses of scenes with other materials, over paths that are found once."""

from dataclasses import replace

import numpy as np
import pytest

from scenes.scene.description import SceneObject
from scenes.scene.shapes import box, sheet
from simulate.rays.core.propagation import Propagation
from simulate.rays.tracer import Tracer
from tests.small_scene import CABINET, small_scene

POSITIONS = np.random.default_rng(0).uniform((2.0, -0.5, 1.0), (3.0, 0.5, 1.6), (5, 3))
PLACE = small_scene(
    CABINET,
    SceneObject("plate", sheet((1.4, -0.4, 0.9), (0, 0.6, 0), (0, 0, 0.6)), "concrete"),
    SceneObject("block", box((1.0, -2.0, 0.3), (2.0, -1.5, 2.0)), "concrete"),
)


def with_concrete(**properties):
    """The place with another concrete."""
    return replace(PLACE, materials=PLACE.materials | {"concrete": replace(PLACE.materials["concrete"], **properties)})


def with_thicker_board():
    """The place with the plate twice as thick."""
    twice = replace(PLACE.objects[2], thickness=2 * PLACE.thickness(PLACE.objects[2]))
    return replace(PLACE, objects=(*PLACE.objects[:2], twice, PLACE.objects[3]))


@pytest.mark.parametrize(
    "propagation",
    [
        pytest.param(Propagation(max_depth=2, rays=20_000), marks=pytest.mark.slow),
        Propagation(max_depth=2, rays=20_000, diffraction=False),
        Propagation(max_depth=2, rays=5_000, sionna=True, diffraction=False),
    ],
    ids=["with diffraction", "without", "Sionna's way"],
)
def test_responses_are_those_of_tracers_of_the_other_scenes(propagation):
    others = [with_concrete(relative_permittivity=4.0), with_concrete(conductivity=0.2), with_thicker_board()]
    tracer = Tracer(PLACE, propagation)
    before = tracer.responses(POSITIONS)
    found = tracer.responses_with(others, POSITIONS)
    for responses, other in zip(found, others, strict=True):
        expected = Tracer(other, propagation, found=tracer.found).responses(POSITIONS)
        assert np.abs(expected - before).max() > 0.01 * np.abs(before).max()
        np.testing.assert_allclose(responses, expected, atol=1e-5 * np.abs(before).max())
    np.testing.assert_array_equal(tracer.responses(POSITIONS), before)
