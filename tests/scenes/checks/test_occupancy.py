"""Inside means inside something solid: not in a room, not under a table, not beside a sheet."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation
from trimesh import Trimesh

from scenes.checks.occupancy import (
    blocking_object,
    element_positions,
    inside_object,
    obstruction,
    rough_winding_number,
    winding_number,
)
from scenes.checks.validation import validate
from scenes.files.errors import InputError
from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.description import SceneObject
from scenes.scene.materials import p2040_materials
from scenes.scene.orientation import facing
from scenes.scene.shapes import box, rotate, sheet, union
from simulate.spectra.array import PlanarArray


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


def test_under_a_table_is_free(scene):
    legs = [box((x, y, 0.01), (x + 0.1, y + 0.1, 0.69)) for x in (0, 0.9) for y in (0, 0.9)]
    table = SceneObject("table", union(box((0, 0, 0.7), (1, 1, 0.75)), *legs), "wood")
    points = np.array([[0.5, 0.5, 0.3], [0.5, 0.5, 0.72], [0.05, 0.05, 0.3]])
    assert inside_object(replace(scene, objects=(table,)), points).tolist() == [False, True, True]


def test_points_level_with_edges_and_vertices(scene):
    """Where counting the crossings of an axis-parallel ray goes wrong."""
    crate = SceneObject("crate", rotate(box((0, 0, 0), (1, 1, 1)), 45), "wood")
    points = np.array([[0.5, 0.5, 0.5], [0.5, 0.5, 2.0], [2.0, 0.5, 0.5], [-1.0, 0.5, 0.5], [0.5, 1.3, 0.5]])
    assert inside_object(replace(scene, objects=(crate,)), points).tolist() == [True, *[False] * 4]


def test_corners_repeated_per_face_are_closed():
    """As STL and textured meshes come."""
    loose = box((0, 0, 0), (1, 1, 1))
    soup = Trimesh(loose.triangles.reshape(-1, 3), np.arange(36).reshape(-1, 3), process=False)
    assert len(SceneObject("soup", soup, "wood").closed_parts) == 1
    assert SceneObject("sheet", sheet((0, 0, 0), (1, 0, 0), (0, 1, 0)), "wood").closed_parts == []


def test_winding_number_against_a_sphere():
    ball = trimesh.creation.icosphere(subdivisions=3, radius=1.0)
    points = np.random.default_rng(0).uniform(-1.5, 1.5, (2000, 3))
    radius = np.linalg.norm(points, axis=1)
    clear = np.abs(radius - 1) > 0.02  # the facets are that far from the sphere
    wound = winding_number(points, ball.triangles)
    np.testing.assert_allclose(wound[clear], (radius < 1)[clear], atol=1e-9)
    np.testing.assert_allclose(rough_winding_number(points, ball.triangles), wound, atol=0.1)


def test_triangles_that_face_both_ways(scene):
    crate = box((0, 0, 0), (1, 1, 1))
    mixed = Trimesh(crate.vertices, [f[::-1] if k % 2 else f for k, f in enumerate(crate.faces)], process=False)
    item = SceneObject("crate", mixed, "wood")
    points = np.array([[0.5, 0.5, 0.5], [0.1, 0.2, 0.9], [0.5, 0.5, 1.1]])
    assert inside_object(replace(scene, objects=(item,)), points).tolist() == [True, True, False]


WAVELENGTH = 0.32
WALL = SceneObject("wall", sheet((0, -3, 0), (0, 6, 0), (0, 0, 3)), "brick")  # the plane x = 0


def where(gateway, *objects):
    found = obstruction(gateway, WAVELENGTH, objects or (WALL,))
    return found and found.where


def test_elements_are_numbered_as_the_array_numbers_them():
    gateway = Gateway((1.0, 2.0, 3.0), facing((0.3, -1.0, 0.2)), rows=3, columns=5, spacing=0.4)
    turned = Rotation.from_quat(gateway.orientation).apply(PlanarArray.of(gateway).positions)
    np.testing.assert_allclose(element_positions(gateway, 0.1), gateway.position + 0.1 * turned, atol=1e-12)


@pytest.mark.parametrize(
    ("distance", "boresight", "expected"),
    [
        (0.0005, (1, 0, 0), "on"),
        (0.01, (1, 0, 0), None),  # flat on a wall, like a picture
        (0.01, (1, 0.1, 0), "behind"),  # turned away from it, so that one edge is in it
        (0.2, (0, 1, 0), "behind"),
        (0.25, (0, 1, 0), None),  # half its width and a centimetre
        (0.24, (0, 1, 0), "on"),
    ],
)
def test_array_at_a_wall(distance, boresight, expected):
    assert where(Gateway((distance, 0, 1.5), facing(boresight))) == expected


def test_wall_that_ends_before_the_array_is_not_in_its_way():
    gateway = Gateway((0, 3.3, 1.5), facing((0, 1, 0)))
    assert where(gateway) is None
    assert where(replace(gateway, position=(0.01, 2.9, 1.5))) == "behind"


def test_something_thin_between_two_elements_is_found():
    pole = SceneObject("pole", box((-0.01, -0.1, 0), (0.01, -0.07, 3)), "metal")
    assert where(Gateway((0, 0, 1.5), facing((1, 0, 0))), pole) == "behind"


def test_a_higher_frequency_has_a_smaller_array(scene):
    near = replace(scene, gateway=replace(scene.gateway, position=(4.0, -1.5e-16, 0.1)))
    with pytest.raises(InputError, match=r'outdoors: gateway.position .* behind object "floor" .* up to 0.348 m'):
        validate(near, "outdoors")
    validate(replace(near, frequency=9e9, materials=p2040_materials(near.materials, 9e9)), "outdoors")
    both = replace(scene, further_gateways={"low": near.gateway})
    with pytest.raises(InputError, match=r"outdoors: further_gateways.low.position .* object \"floor\""):
        validate(both, "outdoors")
    with pytest.raises(InputError, match=r"up to 80 m from the position; are they in metres\?\)"):
        validate(scene.with_elements([[0, 0, 0], [0, -80, 0]]), "outdoors")


def test_region_in_a_closed_room_that_the_gateway_is_not_in(scene):
    room = replace(scene, objects=(SceneObject("room", box((-5, -5, -0.1), (3, 5, 3)), "concrete"),))
    with pytest.raises(InputError, match=r'outdoors: transmitter.region: .* found it inside "room"'):
        validate(room, "outdoors")
    validate(replace(room, gateway=replace(scene.gateway, position=(2.0, 0.0, 1.0))), "outdoors")
    corner = Transmitter(region_min=(2.0, 4.0, 0.5), region_max=(4.0, 6.0, 1.5))  # half of it is outside
    validate(replace(room, transmitter=corner), "outdoors")
