"""Reading a mesh file of any format: the order of its parts, and parts that are no surfaces."""

import pytest

from scenes.files.errors import InputError
from scenes.importing.mesh_files import read_mesh_file
from tests.scenes.importing.formats.gltf_builder import GltfBuilder

CORNERS = "v 0 0 0\nv 2 0 0\nv 0 2 0\nv 4 0 0\n"


def test_parts_are_in_the_order_of_their_names(tmp_path):
    (tmp_path / "ROOM.OBJ").write_text(CORNERS + "".join(f"o {name}\nf 1 2 3\n" for name in ["b", "a", "C"]))
    assert [part.name for part in read_mesh_file(tmp_path / "ROOM.OBJ").parts] == ["C", "a", "b"]


def test_objects_without_area_do_not_cost_the_others(tmp_path):
    (tmp_path / "room.obj").write_text(f"{CORNERS}o wall\nf 1 2 3\no axis\nf 1 2 4\no point\nf 1 1 1\n")
    file = read_mesh_file(tmp_path / "room.obj")
    assert [part.name for part in file.parts] == ["wall"]
    assert file.left_out == ('2 objects were left out because the triangles have no area (the first is "axis")',)


def test_nodes_that_are_hidden_by_their_scale(tmp_path):
    make = GltfBuilder()
    nodes = [{"mesh": 0, "name": "wall"}, {"mesh": 0, "name": "hidden", "scale": [0, 0, 0]}]
    data = make.glb(meshes=[{"primitives": [make.box((0, 0, 0), (1, 1, 1))]}], nodes=nodes)
    (tmp_path / "room.glb").write_bytes(data)
    file = read_mesh_file(tmp_path / "room.glb")
    assert [part.name for part in file.parts] == ["wall"] and '(the first is "hidden")' in file.left_out[0]


def test_a_file_without_surfaces_says_what_it_has(tmp_path):
    (tmp_path / "scan.obj").write_text("v 0 0 0\nv 1 0 0\nl 1 2\n")
    with pytest.raises(InputError, match=r"with triangles, found none .*; lines were left out: 1 in the file"):
        read_mesh_file(tmp_path / "scan.obj")
