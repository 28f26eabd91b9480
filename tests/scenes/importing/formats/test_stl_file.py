"""STL: text and binary, and the names of solids."""

from pathlib import Path

import numpy as np
import pytest
from trimesh.exchange.stl import export_stl

from scenes.files.errors import InputError
from scenes.importing.formats.stl_file import read_stl
from scenes.scene.shapes import box

FACET = "facet normal 0 0 1\n outer loop\n{}\n endloop\nendfacet\n"


def solid(name: str, *corners: str) -> str:
    return f"solid {name}\n" + FACET.format("\n".join(f"  vertex {each}" for each in corners)) + f"endsolid {name}\n"


def read(data: str | bytes):
    return read_stl(data.encode() if isinstance(data, str) else data, Path("hall.stl"))


def test_solids_keep_their_names():
    text = solid("North Wall", "0 0 0", "1 0 0", "0 1 0") + solid("", "0 0 1", "2 0 1", "0 2 1")
    text += "solid nothing\nendsolid nothing\n" + solid("solid vertex", "0 0 0", "1 0 0", "0 3 0")
    file = read(text.upper().replace("NORTH WALL", "North Wall").replace("SOLID VERTEX", "solid vertex"))
    assert [(part.name, part.node, part.mesh.area) for part in file.parts] == [
        ("North Wall", "North Wall", 0.5),
        ("hall", "", 2),
        ("solid vertex", "solid vertex", 1.5),
    ]


def test_facets_of_more_than_three_corners_are_refused():
    with pytest.raises(InputError, match=r"hall.stl: line 10: expected a facet of three corners, found 5"):
        read(solid("", "0 0 0", "4 0 0", "4 2 0", "2 1 0", "0 2 0"))


@pytest.mark.parametrize("header", [b"exported by a program", b"solid exported by a program"])
def test_binary(header):
    data = header.ljust(80, b" ") + export_stl(box((0, 0, 0), (1, 2, 3)))[80:]
    file = read(data)
    (part,) = file.parts
    assert (part.name, part.node) == ("hall", "")
    np.testing.assert_array_equal(part.mesh.bounds, [[0, 0, 0], [1, 2, 3]])
    assert part.mesh.volume == pytest.approx(6) and part.mesh.area == pytest.approx(22)
