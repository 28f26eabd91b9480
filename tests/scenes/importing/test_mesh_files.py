"""Reading a mesh file of any format: the order of its parts, and parts that are no surfaces."""

import pytest

from scenes.files.errors import InputError
from scenes.importing.mesh_files import read_mesh_file

CORNERS = "v 0 0 0\nv 2 0 0\nv 0 2 0\nv 4 0 0\n"


def test_parts_are_in_the_order_of_their_names(tmp_path):
    (tmp_path / "ROOM.OBJ").write_text(CORNERS + "".join(f"o {name}\nf 1 2 3\n" for name in ["b", "a", "C"]))
    assert [part.name for part in read_mesh_file(tmp_path / "ROOM.OBJ").parts] == ["C", "a", "b"]


def test_objects_without_area_do_not_cost_the_others(tmp_path):
    (tmp_path / "room.obj").write_text(f"{CORNERS}o wall\nf 1 2 3\no axis\nf 1 2 4\no point\nf 1 1 1\n")
    file = read_mesh_file(tmp_path / "room.obj")
    assert [part.name for part in file.parts] == ["wall"]
    assert len(file.left_out) == 1 and file.left_out[0].startswith("2 objects") and '"axis"' in file.left_out[0]


def test_a_file_without_surfaces_says_what_it_has(tmp_path):
    (tmp_path / "scan.obj").write_text("v 0 0 0\nv 1 0 0\nl 1 2\n")
    with pytest.raises(InputError, match=r"scan.obj: .* lines were left out"):
        read_mesh_file(tmp_path / "scan.obj")
