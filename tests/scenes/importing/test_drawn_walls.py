"""What an import makes of walls, and what it says of those that count twice."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from trimesh import Trimesh

from scenes.importing.drawn_walls import counted_twice, drawn_twice, drawn_walls
from scenes.importing.mesh_import import import_scene
from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.description import SceneObject
from scenes.scene.materials import p2040_material
from scenes.scene.orientation import facing
from scenes.scene.shapes import box, sheet, union
from tests.small_scene import small_scene

WALL = SceneObject("wall", box((1, -1, 0.1), (1.2, 1, 2.5)), "concrete")
ANGLES = np.linspace(0, np.pi / 2, 10)
CURVED = SceneObject(
    "curved",
    trimesh.creation.extrude_triangulation(
        np.concatenate([r * np.column_stack([np.cos(ANGLES), np.sin(ANGLES)]) - [4, 0] for r in (1.4, 1.6)]),
        [face for k in range(9) for face in ([k, 10 + k, 11 + k], [k, 11 + k, k + 1])],
        2.5,
    ),
    "concrete",
)


def test_walls_as_drawn_are_kept_and_warned_of():
    scene = small_scene(WALL, CURVED)
    found = drawn_walls(scene, "as-drawn")
    assert found.scene is scene and found.sheets == {} and found.assumed == ()
    (sentence,) = found.warnings
    assert "wall, curved" in sentence and "--walls as-sheets" in sentence
    assert drawn_walls(small_scene(), "as-drawn").warnings == ()
    (sentence,) = drawn_walls(scene, "as-sheets").warnings
    assert "curved" in sentence  # it cannot be a sheet


def test_rooms_houses_and_metal_do_not_count_twice():
    scene = small_scene(
        SceneObject("room", box((-2, -2, 0.1), (4, 2, 2.5)), "concrete"),
        SceneObject("house", box((5, 5, 0.1), (9, 9, 6)), "concrete"),
        SceneObject("screen", CURVED.mesh, "metal"),
    )
    assert counted_twice(scene) == []


def imported(path, **options):
    gateway = Gateway((0.5, 2.0, 1.5), facing((1, 0, 0)))
    region = Transmitter((4.0, 1.0, 0.5), (5.0, 3.0, 1.5))
    return import_scene(path, default_material="concrete", gateway=gateway, transmitter=region, **options)


def test_import_makes_sheets_unless_told_otherwise(tmp_path):
    walls = [box((0, -0.2, 0), (6, 0, 2.8)), box((0, 4, 0), (6, 4.2, 2.8)), box((3, 1, 0), (3.12, 3, 2.8))]
    path = tmp_path / "walls.ply"
    path.write_bytes(union(*walls).export(file_type="ply"))
    scene, report = imported(path)
    assert report.sheets == {"walls, 0.2 m thick": 0.2, "walls, 0.12 m thick": 0.12}
    assert set(report.sizes) == set(report.sheets) == {item.name for item in scene.objects}
    assert any("walls, 0.2 m thick (0.2 m)" in sentence for sentence in report.assumed)
    scene, report = imported(path, walls="as-drawn")
    assert report.sheets == {} and len(scene.objects[0].mesh.faces) == 36
    assert any("--walls as-sheets" in sentence for sentence in report.warnings)


INNER = box((-2, -2, 0.3), (4, 2, 2.7))
INNER.invert()
SKINS = union(*(sheet((x, -1, 0.1), (0, 2, 0), (0, 0, 2.4)) for x in (1, 1.1)))


@pytest.mark.parametrize(
    ("mesh", "thickness"), [(union(box((-2.2, -2.2, 0.1), (4.2, 2.2, 2.9)), INNER), 0.2), (SKINS, 0.1)]
)
def test_two_sides_of_a_wall_that_are_not_one_body_are_told(mesh, thickness):
    (sentence,) = drawn_walls(small_scene(SceneObject("shell", mesh, "concrete")), "as-sheets").warnings
    assert f"shell ({thickness} m)" in sentence and "two sides" in sentence


def test_layers_of_two_materials_are_not_the_sides_of_one_wall():
    layers = [("concrete", 1.0), ("wood", 1.1)]
    sheets = [(name, sheet((x, -1, 0.1), (0, 2, 0), (0, 0, 2.4))) for name, x in layers]
    scene = small_scene(*(SceneObject(f"wall/{name}", mesh, name) for name, mesh in sheets))
    scene = replace(scene, materials=scene.materials | {"wood": p2040_material("wood", 915e6)})
    assert drawn_walls(scene, "as-sheets").warnings == ()


def test_walls_of_which_sheets_were_made_are_not_told_again():
    parallel = box((1.3, -1, 0.1), (1.5, 1, 2.5))
    scene = small_scene(SceneObject("wall", union(WALL.mesh, parallel), "concrete"))
    found = drawn_walls(scene, "as-sheets")
    assert found.sheets == {"wall": 0.2} and found.warnings == ()


def test_two_sides_of_a_wall_with_two_names_of_a_material_are_told(tmp_path):
    corners = "\n".join(f"v {x} {y} {z}" for x in (0, 8) for y in (3, 3.2) for z in (0, 3))
    wall = f"o Wall\n{corners}\nusemtl inside\nf 1 2 6 5\nusemtl facade\nf 3 4 8 7\nf 1 3 7 5\nf 2 4 8 6\nf 1 2 4 3\n"
    wall += "f 5 6 8 7\no Floor\nv 0 0 0\nv 8 0 0\nv 8 3 0\nv 0 3 0\nf 9 10 11 12\n"
    (tmp_path / "house.obj").write_text(wall)
    _, report = imported(tmp_path / "house.obj")
    assert any("Wall (0.2 m)" in each and "two sides" in each for each in report.warnings)
    (tmp_path / "house.obj").write_text(wall.replace("facade", "inside"))
    assert "Wall" in imported(tmp_path / "house.obj")[1].sheets


@pytest.mark.parametrize("back", ["4 3 2 1", "1 4 3 2", "3 2 1 4", "2 1 4 3"])
def test_a_wall_of_quadrilaterals_that_is_drawn_from_both_sides_is_told(back, tmp_path):
    corners = [f"v {x} 3 {z}" for x, z in ((0, 0), (8, 0), (8, 3), (0, 3))]
    (tmp_path / "house.obj").write_text("\n".join(["o Wall", *corners, "f 1 2 3 4", f"f {back}"]))
    _, report = imported(tmp_path / "house.obj")
    assert any("2 triangles lie exactly on another one" in each for each in report.warnings)


SHEET = sheet((1, -1, 0.1), (0, 2, 0), (0, 0, 2))


def test_twins_are_counted_within_and_between_objects():
    turned = Trimesh(SHEET.vertices + 1e-6, SHEET.faces[:, ::-1], process=False)
    both_sides = Trimesh(SHEET.vertices, np.vstack([SHEET.faces, SHEET.faces[:, [2, 0, 1]]]), process=False)
    beside = SHEET.copy().apply_translation((0.01, 0, 0))
    meshes = {"wall": SHEET, "paint": turned, "other": beside}
    objects = [SceneObject(name, mesh, "concrete") for name, mesh in meshes.items()]
    assert drawn_twice(small_scene(*objects)) == {("wall", "paint"): 2}
    assert drawn_twice(small_scene(SceneObject("wall", both_sides, "concrete"))) == {("wall", "wall"): 2}


def test_metal_on_metal_is_one_conductor():
    scene = small_scene(*(SceneObject(name, box((1, 1, 0.1), (2, 2, 1)), "metal") for name in "ab"))
    assert drawn_twice(scene) == {}
    coated = (*scene.objects[:-1], replace(scene.objects[-1], material="concrete"))
    assert drawn_twice(replace(scene, objects=coated)) == {("a", "b"): 12}


def test_triangles_with_the_same_centre_are_no_twins():
    angles = np.linspace(0, 2 * np.pi, 3, endpoint=False)
    meshes = []
    for turn in np.linspace(0, 2, 50):
        corners = np.stack([2 + np.cos(angles + turn), np.sin(angles + turn), np.ones(3)], axis=1)
        meshes.append(Trimesh(corners.round(3), [[0, 1, 2]], process=False))
    assert drawn_twice(small_scene(*(SceneObject(f"t{k}", mesh, "concrete") for k, mesh in enumerate(meshes)))) == {}
