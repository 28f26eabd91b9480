"""The rough test that spares most exact ones: it lets every path through, and little else."""

import numpy as np
import pytest

from scenes.places.lab import lab
from scenes.scene.shapes import sheet
from simulate.rays.core import reflection_chains
from simulate.rays.core.planes import Planes
from simulate.rays.core.reflections import possible_paths


def everything(planes, sequences, sources, targets):
    return np.indices((len(targets), len(sequences), len(sources))).reshape(3, -1)


def test_no_path_is_dropped(room_tracer, room_positions, room_responses, monkeypatch):
    monkeypatch.setattr(reflection_chains, "possible_paths", everything)
    assert (room_tracer.responses(room_positions) == room_responses).all()


@pytest.fixture(scope="module")
def mirror(make_scene):
    """A 2 m × 2 m sheet in the plane x = −3, centred on (−3, 0, 1)."""
    return Planes(make_scene(("mirror", sheet((-3, -1, 0), (0, 2, 0), (0, 0, 2)), "concrete")), [7])


def test_nothing_behind_a_mirror_sees_itself_in_it(mirror):
    source, target = np.array([[0.0, 0.0, 1.0]]), np.array([[-4.0, 0.5, 1.0]])
    assert possible_paths(mirror, np.array([[0]]), source, target).shape[1] == 0


@pytest.mark.parametrize("y, expected", [(1.66, True), (1.70, False)])
def test_reflection_beyond_the_edge_is_none(mirror, y, expected):
    """From the origin to (−1, y): reflected at three fifths of y, and the sheet ends at 1 m (and a margin of 1 cm)."""
    found = possible_paths(mirror, np.array([[0]]), np.array([[0.0, 0.0, 1.0]]), np.array([[-1.0, y, 1.0]]))
    assert found.shape[1] == expected


def test_other_interactions_do_not_matter(mirror):
    source, target = np.array([[0.0, 0.0, 1.0]]), np.array([[-1.0, 0.5, 1.0]])
    sequences = np.array([[0, -1, -1], [-1, 0, -1], [-1, -1, -1]])
    assert possible_paths(mirror, sequences, source, target).tolist() == [[0, 0, 0], [0, 1, 2], [0, 0, 0]]


def test_most_of_what_is_tried_is_impossible():
    scene = lab()
    planes = Planes(scene, list(range(len(scene.objects))))
    generator = np.random.default_rng(0)
    sequences = generator.integers(len(planes.normals), size=(2000, 3))
    region = scene.transmitter
    targets = generator.uniform(region.region_min, region.region_max, (20, 3))
    found = possible_paths(planes, sequences, np.array([scene.gateway.position]), targets)
    assert 0 < found.shape[1] < 0.05 * len(sequences) * len(targets)
