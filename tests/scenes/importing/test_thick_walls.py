"""Walls and boards that are drawn as closed boxes become one sheet each, where their slab is."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from trimesh import Trimesh

from scenes.importing.thick_walls import mid_surfaces, walls_as_sheets
from scenes.places.built_in import office
from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.description import Scene, SceneObject
from scenes.scene.materials import p2040_materials
from scenes.scene.orientation import facing
from scenes.scene.shapes import box, rotate, sheet, union

T, X, Y, Z = 0.2, 6.0, 4.0, 2.8  # Thickness of the walls, and size of a room, metres


def room(*objects: SceneObject) -> Scene:
    """Four concrete walls, drawn as boxes in one mesh, with some objects."""
    boxes = [
        box((-T, -T, 0), (X + T, 0, Z)),
        box((-T, Y, 0), (X + T, Y + T, Z)),
        box((-T, 0, 0), (0, Y, Z)),
        box((X, 0, 0), (X + T, Y, Z)),
    ]
    return Scene(
        name="room",
        frequency=915e6,
        gateway=Gateway((0.5, 2.0, 1.5), facing((1, 0, 0))),
        transmitter=Transmitter((4.0, 1.0, 0.5), (5.0, 3.0, 1.5)),
        objects=(SceneObject("walls", union(*boxes), "concrete"), *objects),
        materials=p2040_materials(["concrete", "glass", "metal", "chipboard", "wood"], 915e6),
    )


def made(*objects: SceneObject) -> dict[str, SceneObject]:
    return {item.name: item for item in walls_as_sheets(room(*objects))[0].objects}


def prism(outline: Trimesh, height: float) -> Trimesh:
    """The flat mesh, which lies in z = 0, extruded upwards."""
    return trimesh.creation.extrude_triangulation(outline.vertices[:, :2], outline.faces, height)


def test_outer_walls_become_sheets_on_their_inner_faces():
    scene, sheets = walls_as_sheets(room())
    (walls,) = scene.objects
    assert sheets == {"walls": T} and walls.thickness == T and walls.material == "concrete"
    np.testing.assert_allclose(walls.mesh.bounds, [[-T, 0, 0], [X + T, Y, Z]])
    assert walls.mesh.area == pytest.approx(2 * ((X + 2 * T) + Y) * Z)


def test_inner_walls_become_sheets_in_the_middle_however_they_are_turned():
    wall = rotate(box((3, 0.5, 0), (3.1, 3.5, Z)), 20)
    found = made(SceneObject("partition", wall, "concrete"))["partition"]
    assert found.thickness == 0.1 and found.mesh.area == pytest.approx(3 * Z)
    corners = rotate(sheet((3.05, 0.5, 0), (0, 3, 0), (0, 0, Z)), 20).vertices
    np.testing.assert_allclose(sorted(found.mesh.vertices.tolist()), sorted(corners.tolist()), atol=1e-9)


def test_openings_stay_open():
    outline = sheet((1, 1, 0), (2, 0, 0), (0, 2, 0), openings=[(0.5, 1.2, 0.4, 1.6)])
    hatch = made(SceneObject("hatch", prism(outline, 0.15).apply_translation((0, 0, 1.0)), "concrete"))["hatch"].mesh
    assert hatch.area == pytest.approx(4 - 0.84) and hatch.bounds[:, 2] == pytest.approx([1.075] * 2)


def test_boxes_without_ends_and_mitred_walls_are_plates():
    wall = box((3, 0.5, 0), (3.2, 3.5, Z))
    open_ends = Trimesh(wall.vertices, wall.faces[np.abs(wall.face_normals[:, 2]) < 0.5], process=False)
    assert [plate.thickness for plate in mid_surfaces(open_ends, 0.4)] == pytest.approx([0.2])
    mitred = wall.copy()
    mitred.vertices[(wall.vertices[:, 0] > 3.1) & (wall.vertices[:, 1] > 2)] += [0, 0.2, 0]
    (plate,) = mid_surfaces(mitred, 0.4)
    assert plate.thickness == 0.2
    assert Trimesh(plate.sheet.reshape(-1, 3), np.arange(6).reshape(2, 3)).area == pytest.approx(3.2 * Z)  # no gap


def test_boards_of_furniture_and_columns_stay_as_drawn():
    objects = (
        SceneObject("wardrobe", box((1, 3, 0), (2, 3.6, 2)), "chipboard"),  # 18 mm boards around air
        SceneObject("column", box((3, 2, 0), (3.3, 2.3, Z)), "concrete"),
        SceneObject("wedge", trimesh.convex.convex_hull([(1, 1, 0), (2, 1, 0), (1, 2, 0), (1, 1, 0.2)]), "concrete"),
        SceneObject("double glazing", box((3, 0.5, 1), (3.03, 1.5, 2)), "glass"),  # two panes of 6 mm
        SceneObject("door", box((3, 2.7, 0), (3.04, 3.6, 2)), "metal"),  # reflects at its surface, however thick
    )
    found = made(*objects)
    assert all(found[item.name] is item for item in objects)


def test_table_top_and_what_is_drawn_thinner_than_its_slab():
    found = made(
        SceneObject("top", box((1, 1, 0.7), (2, 2, 0.74)), "wood"),
        SceneObject("thin wall", box((3, 1, 0), (3.001, 3, 2)), "concrete"),
    )
    assert found["top"].thickness == 0.04 and found["top"].mesh.bounds[0, 2] == pytest.approx(0.72)
    assert found["thin wall"].thickness == T  # 1 mm of concrete is drawn, but hardly meant


def test_other_parts_and_other_thicknesses_become_objects_of_their_own():
    walls = [box((x, 1, 0), (x + thickness, 3, 2)) for x, thickness in ((3, 0.2), (2, 0.12), (1, 0.12))]
    parts = union(*walls, box((4, 3.2, 0), (4.4, 3.6, 0.4)))
    scene, sheets = walls_as_sheets(room(SceneObject("inside", parts, "concrete")))
    assert sheets == {"walls": T, "inside, 0.2 m thick": 0.2, "inside, 0.12 m thick": 0.12}
    found = {item.name: item for item in scene.objects}
    assert found["inside"].thickness is None and len(found["inside"].mesh.faces) == 12
    assert found["inside, 0.12 m thick"].mesh.area == pytest.approx(8)


def test_house_in_one_body_is_divided_into_its_walls():
    """Outer walls of 0.2 m around two rooms, and a wall of 0.1 m with a doorway between them."""
    rooms = [(0.2, 3.2, 0.2, 4.2), (3.3, 6.2, 0.2, 4.2), (3.2, 3.3, 1.0, 2.0)]
    house = prism(sheet((-T, -T, 0), (X + 2 * T, 0, 0), (0, Y + 2 * T, 0), openings=rooms), Z)
    assert house.is_watertight
    scene, sheets = walls_as_sheets(replace(room(), objects=(SceneObject("house", house, "concrete"),)))
    assert sheets == {"house, 0.2 m thick": 0.2, "house, 0.1 m thick": 0.1}
    assert sheets == {item.name: item.thickness for item in scene.objects}
    outer, inner = (item.mesh for item in scene.objects)
    flat = [(axis, t[:, axis]) for t in outer.triangles for axis in (0, 1)]
    planes = {(axis, round(float(places[0]), 3)) for axis, places in flat if np.ptp(places) < 1e-9}
    assert planes == {(0, 0.0), (0, X), (1, 0.0), (1, Y)}  # their inner faces, which meet in the corners of the rooms
    assert inner.area == pytest.approx(3 * Z)
    np.testing.assert_allclose(inner.bounds[:, 0], 3.05)


def test_outer_wall_of_several_thicknesses_has_a_sheet_for_each():
    steps = trimesh.creation.extrude_triangulation(
        [(1, 1), (3, 1), (5, 1), (5, 1.1), (3, 1.1), (3, 1.3), (1, 1.3)],
        [(0, 1, 4), (1, 2, 3), (1, 3, 4), (0, 4, 5), (0, 5, 6)],
        2.5,
    )
    scene, sheets = walls_as_sheets(room(SceneObject("steps", steps, "concrete")))
    assert sheets == {"walls": T, "steps, 0.3 m thick": 0.3, "steps, 0.1 m thick": 0.1}
    assert [item.mesh.area for item in scene.objects[1:]] == pytest.approx([5.0, 5.0])


def test_places_of_ours_are_drawn_right_already():
    place = office()
    assert walls_as_sheets(place) == (place, {})
    assert walls_as_sheets(replace(place, objects=place.objects[:1]))[1] == {}
