"""OBJ: polygons by object, group and material, in every way of writing them."""

from pathlib import Path

import numpy as np
import pytest

from scenes.importing.formats.obj_file import read_obj

SQUARE = "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\n"


def read(text: str | bytes):
    return read_obj(text if isinstance(text, bytes) else text.encode(), Path("room.obj"))


def described(file) -> list[tuple]:
    return [(part.name, part.node, part.material, round(part.mesh.area, 6)) for part in file.parts]


@pytest.mark.parametrize(
    "face",
    [
        "f 1 2 3 4",
        "f 1/1 2/2 3/3 4/4",
        "f 1//9 2//9 3//9 4//9",
        "f 1/1/1 2/2/1 3/3/1 4/4/1",
        "f -4 -3 -2 -1",
        "f 1 2 \\\n 3 4",
        "f\t1  2\t3 4  # a floor",
        "fo 1 2 3 4",
        "f 1 2 3 4\r\n",
    ],
)
def test_ways_to_write_a_face(face):
    assert described(read(SQUARE + face)) == [("room", "", None, 4)]


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "latin-1"])
def test_encodings(encoding):
    text = f"o Wände\n{SQUARE}f 1 2 3 4\n"
    assert described(read(text.encode(encoding))) == [("Wände", "Wände", None, 4)]


def test_vertices_may_have_weights_and_colours_and_negative_numbers_count_from_where_they_stand():
    (part,) = read("v 9 9 9\nv 0 0 0 1\nv 1 0 0 0.5 0.5 0.5\nv +1e0 1. -0.0\nf -3 -2 -1\nv 5 5 5\n").parts
    np.testing.assert_array_equal(part.mesh.vertices, [[0, 0, 0], [1, 0, 0], [1, 1, 0]])


def test_objects_groups_and_materials():
    text = f"""{SQUARE}f 1 2 3
usemtl  clear glass
o facade
f 1 2 3
g north side
f 1 2 3 4
usemtl brick
f 1 2 4
usemtl clear glass
f 1 2 3
o door
g
f 1 2 3
usemtl
f 1 2 3
"""
    assert described(read(text)) == [
        ("room", "", None, 2),
        ("facade", "facade", "clear glass", 2),
        ("facade_north side/clear glass", "facade_north side", "clear glass", 6),
        ("facade_north side/brick", "facade_north side", "brick", 2),
        ("door/clear glass", "door", "clear glass", 2),
        ("door", "door", None, 2),
    ]


def test_what_is_left_out_is_named():
    file = read(
        f"{SQUARE}f 1 2 3 4\nl 1 2\nl 2 3\np 1\nf 1 2\nsurf 0 1 0 1 1 2\ncall other.obj\nfaces 1 2 3\nvn 0 0 1\n"
    )
    assert described(file) == [("room", "", None, 4)]
    assert [sentence.split(" were ")[0].split()[0] for sentence in file.left_out] == [
        *("lines", "points", "free-form", "calls", "statements", "faces")
    ]
    assert "2 in the file" in file.left_out[0]


def test_crossing_faces_are_left_out_of_their_part_only():
    file = read(f"{SQUARE}o a\nf 1 2 3 4\no b\nf 1 3 2 4\nf 1 2 3\n")
    assert described(file) == [("a", "a", None, 4), ("b", "b", None, 2)]
    assert "face 2" in file.left_out[0]


def test_comments_before_the_first_vertex_tell_blender_and_a_backslash_does_not_continue_them():
    file = read(f"# Blender 4.2.0\n# from C:\\models\\\no Wall\nusemtl glass\n{SQUARE}# later\nf 1 2 3 4")
    assert file.blender and not read(f"{SQUARE}# Blender\nf 1 2 3 4").blender
    assert described(file) == [("Wall", "Wall", "glass", 4)]
