"""Inside means inside something solid: not in a room, not under a table, not beside a sheet."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from trimesh import Trimesh

from scenes.checks.occupancy import blocking_object, inside_object, winding_number
from scenes.scene.closed_parts import closed_parts
from scenes.scene.description import SceneObject
from scenes.scene.shapes import box, rotate, sheet, union


def test_box_and_sheet(scene):
    points = np.array([[0.5, 0.5, 0.2], [0.5, 0.5, 0.4], [0.5, 0.5, 0.05], [0.0, 0.0, -1.0]])
    assert inside_object(scene, points).tolist() == [True, False, False, False]
    assert blocking_object(scene, points) == ["crate", None, None, None]


def test_room_is_not_an_obstacle(scene):
    room = SceneObject("room", box((-5, -5, -0.1), (5, 5, 3)), "concrete")
    assert not inside_object(replace(scene, objects=(room,)), np.array([[0.0, 0.0, 1.0]]))[0]
    # One that holds the gateway but not the region is a box around the gateway.
    hood = SceneObject("hood", box((3, -1, 0), (5, 1, 2)), "metal")
    assert blocking_object(replace(scene, objects=(room, hood)), np.array([[4.0, 0.0, 1.0]])) == ["hood"]


def test_room_as_tight_as_the_region(scene):
    room = SceneObject("room", box((-1, -1, 0.5), (5, 1, 1.5)), "concrete")
    assert not inside_object(replace(scene, objects=(room,)), np.array([[0.0, 0.0, 1.0]]))[0]


def test_under_a_table_is_free(scene):
    legs = [box((x, y, 0.01), (x + 0.1, y + 0.1, 0.69)) for x in (0, 0.9) for y in (0, 0.9)]
    table = SceneObject("table", union(box((0, 0, 0.7), (1, 1, 0.75)), *legs), "wood")
    points = np.array([[0.5, 0.5, 0.3], [0.5, 0.5, 0.72], [0.05, 0.05, 0.3]])
    assert inside_object(replace(scene, objects=(table,)), points).tolist() == [False, True, True]


def test_points_level_with_edges_and_vertices(scene):
    """Where counting the crossings of an axis-parallel ray goes wrong."""
    crate = SceneObject("crate", rotate(box((0, 0, 0), (1, 1, 1)), 45), "wood")
    points = np.array([[0.5, 0.5, 0.5], [0.5, 0.5, 2.0], [2.0, 0.5, 0.5], [-1.0, 0.5, 0.5], [0.5, 1.3, 0.5]])
    assert inside_object(replace(scene, objects=(crate,)), points).tolist() == [
        True,
        False,
        False,
        False,
        False,
    ]


def test_corners_repeated_per_face_are_closed():
    """As STL and textured meshes come."""
    loose = box((0, 0, 0), (1, 1, 1))
    soup = Trimesh(loose.triangles.reshape(-1, 3), np.arange(36).reshape(-1, 3), process=False)
    assert len(closed_parts(soup)) == 1
    assert closed_parts(sheet((0, 0, 0), (1, 0, 0), (0, 1, 0))) == []


def test_winding_number_against_a_sphere():
    ball = trimesh.creation.icosphere(subdivisions=3, radius=1.0)
    points = np.random.default_rng(0).uniform(-1.5, 1.5, (2000, 3))
    radius = np.linalg.norm(points, axis=1)
    clear = np.abs(radius - 1) > 0.02  # the facets are that far from the sphere
    wound = winding_number(points, ball.triangles)
    np.testing.assert_allclose(wound[clear], (radius < 1)[clear], atol=1e-9)


def test_inverted_normals_do_not_matter(scene):
    inverted = box((0, 0, 0), (1, 1, 1))
    inverted.invert()
    item = SceneObject("crate", inverted, "wood")
    assert inside_object(replace(scene, objects=(item,)), np.array([[0.5, 0.5, 0.5]]))[0]


def test_triangles_that_face_both_ways(scene):
    crate = box((0, 0, 0), (1, 1, 1))
    mixed = Trimesh(crate.vertices, [f[::-1] if k % 2 else f for k, f in enumerate(crate.faces)], process=False)
    item = SceneObject("crate", mixed, "wood")
    points = np.array([[0.5, 0.5, 0.5], [0.1, 0.2, 0.9], [0.5, 0.5, 1.1]])
    assert inside_object(replace(scene, objects=(item,)), points).tolist() == [True, True, False]


@pytest.mark.parametrize("count", [0, 1])
def test_few_points(scene, count):
    assert inside_object(scene, np.zeros((count, 3))).shape == (count,)
