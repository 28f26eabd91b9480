"""PLY: text and binary of both byte orders, polygons of different sizes, and what else is in it."""

import struct
from pathlib import Path

import numpy as np
import pytest

from scenes.files.errors import InputError
from scenes.importing.formats.ply_file import read_ply

CORNERS = [(0, 0, 0), (4, 0, 0), (4, 2, 0), (2, 1, 0), (0, 2, 0), (9, 9, 9)]
FACES = [(0, 1, 3), (0, 1, 2, 3, 4), (0, 1, 2, 4)]
"""A triangle of 2, a pentagon with a notch of 6, a rectangle of 8."""
FORMATS = ["ascii", "binary_little_endian", "binary_big_endian"]


def ply(kind: str, faces=FACES, index: str = "int", length: str = "uchar", name: str = "vertex_indices") -> bytes:
    """A PLY file with a colour for each vertex and face."""
    order = ">" if kind == "binary_big_endian" else "<"
    codes = {"uchar": "B", "int": "i", "uint": "I", "uint16": "H", "int8": "b"}
    head = f"""ply
format {kind} 1.0
comment from a test
element vertex {len(CORNERS)}
property float x
property float y
property float z
property uchar red
element face {len(faces)}
property uchar red
property list {length} {index} {name}
property float quality
end_header
"""
    if kind == "ascii":
        rows = [f"{x} {y} {z} 255" for x, y, z in CORNERS] + [
            f"255 {len(face)} {' '.join(map(str, face))} 0.5" for face in faces
        ]
        return (head + "\n".join(rows)).encode()
    body = b"".join(struct.pack(f"{order}fffB", *corner, 255) for corner in CORNERS)
    for face in faces:
        row = f"{order}B{codes[length]}{len(face)}{codes[index]}f"
        body += struct.pack(row, 255, len(face), *face, 0.5)
    return head.encode() + body


def area(data: bytes) -> float:
    (part,) = read_ply(data, Path("floor.ply")).parts
    return part.mesh.area


@pytest.mark.parametrize("kind", FORMATS)
def test_polygons_and_the_types_and_names_of_their_list(kind):
    assert area(ply(kind)) == area(ply(kind, index="uint16", length="int")) == pytest.approx(16)
    assert area(ply(kind, index="uint", length="int8", name="vertex_index")) == pytest.approx(16)
    assert area(ply(kind, FACES[1:2] * 3)) == pytest.approx(18) and area(ply(kind, FACES[:1])) == pytest.approx(2)


def test_line_ends_of_windows():
    text = ply("ascii").replace(b"\n", b"\r\n")
    binary = ply("binary_little_endian")
    head, _, body = binary.partition(b"end_header\n")
    assert area(text) == area(head.replace(b"\n", b"\r\n") + b"end_header\r\n" + body) == pytest.approx(16)


def test_rows_with_more_numbers_than_declared():
    """MeshLab once wrote the colours of a face as a list, and declared four numbers."""
    head, _, body = ply("ascii").partition(b"end_header\n")
    rows = b"\n".join(row + b" 9 1 1 1" for row in body.split(b"\n"))
    assert area(head + b"end_header\n" + rows) == pytest.approx(16)


def test_triangle_strips_are_refused():
    strips = b"element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
    with pytest.raises(InputError, match=r"floor.ply: .* triangle strips"):
        area(ply("ascii").replace(b"end_header\n", strips) + b"\n4 0 1 4 2")


def test_what_is_left_out_is_named():
    data = ply("ascii", [*FACES, (0, 1)]).replace(
        b"element face", b"element edge 2\nproperty int vertex1\nproperty int vertex2\nelement face"
    )
    head, _, body = data.partition(b"end_header\n")
    rows = body.split(b"\n")
    rows[len(CORNERS) : len(CORNERS)] = [b"0 1", b"1 2"]
    file = read_ply(head + b"end_header\n" + b"\n".join(rows), Path("floor.ply"))
    edges, lines = file.left_out
    assert '"edge"' in edges and "2 in the file" in edges and "left out: 1 (the first is face 4" in lines
    assert [part.name for part in file.parts] == ["floor"]


def test_double_precision_is_kept():
    data = ply("ascii").replace(b"property float x", b"property double x")
    data = data.replace(b"4 0 0 255", b"4.123456789012345 0 0 255")
    (part,) = read_ply(data, Path("floor.ply")).parts
    assert part.mesh.vertices[1, 0] == 4.123456789012345 and len(part.mesh.vertices) == len(CORNERS)
    np.testing.assert_array_equal(part.mesh.vertices[5], [9, 9, 9])


def test_a_list_of_negative_length_is_refused_wherever_it_stands_in_the_row():
    data = ply("ascii", length="int8").replace(b"255 3 0 1 3 0.5", b"255 -1 0.5")
    with pytest.raises(InputError, match=r"floor\.ply: .*\"face\""):
        read_ply(data, Path("floor.ply"))
