"""OFF: polygons, with comments, normals and colours."""

from pathlib import Path

import pytest

from scenes.files.errors import InputError
from scenes.importing.formats.off_file import read_off

VERTICES = ["0 0 0", "4 0 0", "4 2 0", "2 1 0", "0 2 0"]


def read(text: str):
    return read_off(text.encode(), Path("floor.off"))


@pytest.mark.parametrize(
    ("head", "more"),
    [
        ("OFF\n5 1 0", ""),
        ("# a floor\nOFF # here\n\n5 1 0", "  # a corner"),
        ("OFF 5 1 0", ""),
        ("OFF5 1 0", ""),
        ("COFF\n5 1 0", " 255 0 0 255"),
        ("NOFF\n5 1", " 0 0 1"),
        ("STCNOFF\n5 1 0", " 0 0 1 1 0 0 1 0.5 0.5"),
    ],
)
@pytest.mark.parametrize("colour", ["", " 0.5 0.5 0.5", " 255 0 0 255  # red", " 3"])
def test_a_polygon_with_a_notch(head, more, colour):
    file = read("\n".join([head, *(each + more for each in VERTICES), "5 0 1 2 3 4" + colour]))
    (part,) = file.parts
    assert part.mesh.area == pytest.approx(6) and part.name == "floor" and not file.left_out


def test_a_face_may_take_several_lines_and_what_is_no_polygon_is_named():
    file = read("\n".join(["OFF", "5 4 0", *VERTICES, "5 0 1", "2", "3 4", "3 0 1 2", "2 0 1", "1 0", "3 0 2 4"]))
    assert file.parts[0].mesh.area == pytest.approx(6 + 4)
    lines, faces = file.left_out
    assert "left out: 2 (the first is face 3" in faces and lines.endswith("1, from line 14 on")


@pytest.mark.parametrize("head", ["4OFF", "nOFF", "OFF BINARY", "4nOFF", "PLY"])
def test_other_kinds_are_refused_by_their_names(head):
    with pytest.raises(InputError, match=f"floor.off: .* found '{head}'"):
        read("\n".join([head, "5 1 0", *VERTICES, "3 0 1 2"]))
