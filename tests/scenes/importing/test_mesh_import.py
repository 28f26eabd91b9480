"""Files of other programs land where they should, named, scaled, upright and of the right material."""

import numpy as np
import pytest
import trimesh
from trimesh import Trimesh

from scenes.files.errors import InputError
from scenes.importing.imported_file import read_file
from scenes.importing.imported_objects import import_objects
from scenes.importing.mesh_import import import_scene
from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.shapes import box


def import_mesh(path, rules, default=None, unit="m", up=None):
    """The objects of a file, and the report."""
    file = read_file(path)
    objects, _, report = import_objects(file, rules, default, unit, up or file.up, 2.4e9)
    return objects, report


@pytest.fixture
def glb(tmp_path):
    """A box 1 x 2 x 3 in a node that turns it 90° about y and moves it, as an exporter would."""
    scene = trimesh.Scene()
    place = trimesh.transformations.rotation_matrix(np.pi / 2, [0, 1, 0])
    place[:3, 3] = [100, 0, 50]
    scene.add_geometry(box((0, 0, 0), (1, 2, 3)), node_name="Desk.001", geom_name="mesh", transform=place)
    scene.export(tmp_path / "room.glb")
    return tmp_path / "room.glb"


def test_glb_transform_unit_and_axes(glb):
    (desk,), report = import_mesh(glb, [("Desk*", "wood")], unit="cm")
    # about y: (x, y, z) -> (z, y, -x); moved; then y up to z up: (x, y, z) -> (x, -z, y); then centimetres
    np.testing.assert_allclose(desk.mesh.bounds, np.array([[100, -50, 0], [103, -49, 2]]) / 100, atol=1e-6)
    assert (desk.name, desk.material) == ("Desk.001", "wood")
    assert desk.mesh.is_watertight and desk.mesh.volume > 0
    assert report.degenerate == {} and report.sizes["Desk.001"] == pytest.approx((0.03, 0.01, 0.02))


UNITS = [("m", 1), ("cm", 0.01), ("mm", 1e-3), ("in", 0.0254), ("ft", 0.3048)]


@pytest.mark.parametrize(("unit", "metres"), UNITS)
def test_units_and_y_up_keep_normals_outwards(tmp_path, unit, metres):
    box((0, 0, 0), (10, 20, 30)).export(tmp_path / "crate.ply")
    (crate,), _ = import_mesh(tmp_path / "crate.ply", [], "wood", unit=unit, up="y")
    np.testing.assert_allclose(crate.mesh.bounds, np.array([[0, -30, 0], [10, 0, 20]]) * metres)
    assert crate.mesh.volume == pytest.approx(6000 * metres**3)


@pytest.mark.parametrize("suffix", [".stl", ".ply", ".off"])
def test_single_meshes_are_named_after_the_file(tmp_path, suffix):
    box((0, 0, 0), (1, 1, 1)).export(tmp_path / f"locker{suffix}")
    (locker,), _ = import_mesh(tmp_path / f"locker{suffix}", [("lock*", "metal")])
    assert (locker.name, locker.material) == ("locker", "metal")
    assert len(locker.closed_parts) == 1 and len(locker.mesh.vertices) == 8


def test_degenerate_triangles_are_dropped_and_reported(tmp_path):
    vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 0, 0]]
    faces = [[0, 1, 2], [0, 1, 3], [1, 1, 2]]  # one good, one of collinear corners, one with a corner twice
    Trimesh(vertices, faces, process=False).export(tmp_path / "sliver.ply")
    (sliver,), report = import_mesh(tmp_path / "sliver.ply", [], "wood")
    assert report.degenerate == {"sliver": 2}
    np.testing.assert_allclose(sliver.mesh.triangles, [[[0, 0, 0], [1, 0, 0], [0, 1, 0]]])
    assert len(sliver.mesh.vertices) == 3


WRONG = [
    ("default_material", 5),
    ("unit", "inch"),
    ("up", "x"),
    ("walls", "sheets"),
    ("materials", {"*": "wood"}),
    ("materials", [("*", None)]),
    ("own_materials", [("a", "b")]),
    ("own_materials", {"a": "wood"}),
]


@pytest.mark.parametrize(("option", "value"), WRONG)
def test_wrong_options(glb, option, value):
    given = {"path": glb, "up": "y", "materials": [("*", "wood")]}
    given |= {"gateway": Gateway((0, 0, 0), (0, 0, 0, 1)), "transmitter": Transmitter((0, 0, 1), (1, 1, 2))}
    with pytest.raises(InputError, match=f"^{option}: expected .*, found"):
        import_scene(**{**given, option: value})


CORNERS = "v 0 0 0\nv 2 0 0\nv 0 2 0\nv 4 0 0\n"


def test_parts_are_in_the_order_of_their_names_and_those_without_area_are_left_out(tmp_path):
    faces = {"b": "1 2 3", "a": "1 2 3", "axis": "1 2 4", "point": "1 1 1", "C": "1 2 3"}
    (tmp_path / "ROOM.OBJ").write_text(CORNERS + "".join(f"o {name}\nf {face}\n" for name, face in faces.items()))
    file = read_file(tmp_path / "ROOM.OBJ")
    assert [part.name for part in file.parts] == ["C", "a", "b"]
    assert len(file.left_out) == 1 and file.left_out[0].startswith("2 objects") and '"axis"' in file.left_out[0]


def test_wrong_files(tmp_path):
    (tmp_path / "scan.obj").write_text(f"{CORNERS}l 1 2\n")
    with pytest.raises(InputError, match=r"scan.obj: .* lines were left out"):
        read_file(tmp_path / "scan.obj")
    with pytest.raises(InputError, match=r'room.ifc: .* found ".ifc"'):
        import_mesh(tmp_path / "room.ifc", [], "wood")
    Trimesh([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]], process=False).export(tmp_path / "line.ply")
    with pytest.raises(InputError, match=r'"line": expected a triangle with an area'):
        import_mesh(tmp_path / "line.ply", [], "wood")


def test_parts_of_one_object_get_the_materials_that_the_file_names(tmp_path):
    corners = "".join(f"v {x} {y} {z}\n" for y in (0, 4) for x, z in ((0, 0), (5, 0), (5, 2.7), (0, 2.7)))
    faces = "usemtl Concrete.001\nf 1 2 6 5\nusemtl pane\nf 1 2 3 4\nusemtl ITU_Brick\nf 5 6 7 8\nf 1 4 8 5\n"
    (tmp_path / "room.obj").write_text(f"o Room\n{corners}{faces}")
    objects, report = import_mesh(tmp_path / "room.obj", [("*pane", "glass")], "wood")
    assert {item.name: (item.material, float(item.mesh.area)) for item in objects} == {
        "Room/Concrete.001": ("concrete", pytest.approx(20)),
        "Room/ITU_Brick": ("brick", pytest.approx(24.3)),
        "Room/pane": ("glass", pytest.approx(13.5)),
    }
    (taken,) = report.assumed
    assert taken.endswith("names: concrete (Room/Concrete.001); brick (Room/ITU_Brick)") and report.warnings == ()
