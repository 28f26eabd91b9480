"""A scene in map coordinates, up to 100 km from the origin, gives what it gives at the origin."""

from dataclasses import replace

import numpy as np
import pytest

from scenes.scene.description import shifted
from scenes.scene.materials import p2040_materials
from simulate.rays.core.propagation import Propagation
from simulate.rays.tracer import Tracer
from tests.small_scene import CABINET, small_scene

FOLLOWED = Propagation(max_depth=2, rays=5_000)
POSITIONS = np.array([[2.1, -0.4, 1.1], [2.5, 0.1, 1.4], [2.9, 0.4, 1.5]])
STEPS = [(99_000.0, -99_000.0, 0.0), (-87_654.3, 12_345.6, 519.7)]


def at_frequency(frequency):
    materials = p2040_materials(["concrete", "metal"], frequency)
    return replace(small_scene(CABINET), frequency=frequency, materials=materials)


def largest_difference(found, expected):
    return np.abs(found - expected).max() / np.abs(expected).max()


@pytest.fixture(scope="module")
def near():
    return Tracer(at_frequency(3.5e9), FOLLOWED)


@pytest.fixture(scope="module", params=STEPS, ids=["whole", "odd"])
def far(request):
    step = np.array(request.param)
    return step, Tracer(shifted(at_frequency(3.5e9), step), FOLLOWED)


def test_responses_do_not_depend_on_the_place(near, far):
    step, tracer = far
    assert near.chains == tracer.chains and near.edges is not None and len(near.edges) == len(tracer.edges)
    expected = near.responses(POSITIONS)
    assert largest_difference(tracer.responses(POSITIONS + step), expected) < 2e-3
    assert largest_difference(tracer.responses_by_chain(POSITIONS + step).sum(axis=2), expected) < 2e-3
    there, here = tracer.middle_by_chain(POSITIONS + step), near.middle_by_chain(POSITIONS)
    np.testing.assert_array_equal(np.count_nonzero(there, axis=1), np.count_nonzero(here, axis=1))


@pytest.mark.parametrize("frequency", [28e9, 60e9])
def test_responses_of_any_wavelength(frequency):
    followed = replace(FOLLOWED, diffraction=False)
    scene, step = at_frequency(frequency), np.array(STEPS[1])
    expected = Tracer(scene, followed).responses(POSITIONS)
    assert largest_difference(Tracer(shifted(scene, step), followed).responses(POSITIONS + step), expected) < 0.03


def test_paths_are_where_the_scene_is(near, far):
    step, tracer = far
    np.testing.assert_allclose(tracer.elements.positions - step, near.elements.positions, atol=1e-9)
    np.testing.assert_allclose(tracer.middle.positions - step, near.middle.positions, atol=1e-9)
    found, expected = tracer.paths(POSITIONS[0] + step), near.paths(POSITIONS[0])
    assert len(found) == len(expected) > 3
    for path, other in zip(found, expected, strict=True):
        np.testing.assert_allclose(path.vertices - step, other.vertices, atol=1e-3)


def test_other_ways_to_trace():
    scene, step = small_scene(), np.array(STEPS[1])
    rough = {name: replace(each, scattering_coefficient=0.4) for name, each in scene.materials.items()}
    scene = replace(scene, materials=rough)
    for followed in (
        Propagation(max_depth=1, diffuse=True, diffraction=False, patches=50, rays=10_000),
        Propagation(max_depth=1, sionna=True, diffraction=False, rays=2000),
    ):
        near, far = Tracer(scene, followed), Tracer(shifted(scene, step), followed)
        assert largest_difference(far.responses(POSITIONS + step), near.responses(POSITIONS)) < 2e-3
        ends = [batch.vertices[:, -1] for batch in far.middle_multipath(POSITIONS[:1] + step)]
        np.testing.assert_allclose(np.concatenate(ends) - step - POSITIONS[0], 0, atol=1e-6)
