"""The image method: where chains of planes reflect."""

import numpy as np
import pytest

from scenes.places.built_in import lab
from scenes.scene.shapes import sheet
from simulate.rays.core.image_method import Images
from simulate.rays.core.planes import Planes


def possible_paths(planes, chains, sources, targets):
    return Images(planes, chains, sources).possible_paths(targets)


def test_reflections_lie_on_their_planes_at_equal_angles():
    """In the lab: every way is as long as the straight line from the last image."""
    scene = lab()
    planes = Planes(scene, list(range(len(scene.objects))))
    generator = np.random.default_rng(0)
    chains = generator.integers(len(planes.normals), size=(20_000, 2))
    sources, targets = np.array([scene.gateway.position]), generator.uniform(*scene.transmitter.region, (5, 3))
    images = Images(planes, chains, sources)
    paths = images.possible_paths(targets)
    assert paths.shape[1] > 20
    ways = images.ways(paths, targets)
    points = np.concatenate(
        [np.repeat(sources.T[None], paths.shape[1], axis=2), ways.vertices, targets[paths[0]].T[None]]
    )
    chain = chains[paths[1]].T
    normals = planes.normals[chain].transpose(0, 2, 1)
    np.testing.assert_allclose((ways.vertices * normals).sum(axis=1), planes.offsets[chain], atol=1e-5)
    steps = np.diff(points, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    units = steps / lengths[:, None]
    before, behind = (units[:-1] * normals).sum(axis=1), (units[1:] * normals).sum(axis=1)
    np.testing.assert_allclose(before, -behind, atol=1e-4)
    np.testing.assert_allclose(ways.travelled, lengths.sum(axis=0), rtol=1e-5)
    np.testing.assert_allclose(ways.spreading, 1 / ways.travelled)
    assert (planes.of_face[ways.faces] == chain).all()


@pytest.fixture(scope="module")
def mirror(make_scene):
    """A 2 m × 2 m sheet in the plane x = −3, centred on (−3, 0, 1)."""
    return Planes(make_scene(("mirror", sheet((-3, -1, 0), (0, 2, 0), (0, 0, 2)), "concrete")), [7])


def test_nothing_behind_a_mirror_sees_itself_in_it(mirror):
    source, target = np.array([[0.0, 0.0, 1.0]]), np.array([[-4.0, 0.5, 1.0]])
    assert possible_paths(mirror, np.array([[0]]), source, target).shape[1] == 0


@pytest.mark.parametrize("y, expected", [(1.66, True), (1.67, False)])
def test_reflection_beyond_the_edge_is_none(mirror, y, expected):
    """From the origin to (−1, y): reflected at three fifths of y, and the sheet ends at 1 m."""
    found = possible_paths(mirror, np.array([[0]]), np.array([[0.0, 0.0, 1.0]]), np.array([[-1.0, y, 1.0]]))
    assert found.shape[1] == expected
