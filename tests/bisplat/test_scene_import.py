"""``bisplat scene FILE``: what it lists, writes, says and refuses. The scene is written before it is drawn."""

import errno
import json
import re
from functools import partial

import pytest

from scenes.drawing import scene_drawing
from scenes.scene.shapes import box
from scenes.storage.scene_yaml import load_scene

PLACE = "--gateway 4.7 2 1.8 --boresight -1 0 0 --region-min 1 1 0.8 --region-max 2.5 3 1.7".split()
XML = """\
<scene version="2.1.0">
<bsdf type="diffuse" id="mat-itu_concrete.002"/><bsdf type="diffuse" id="mat-absorber"/>
<shape type="ply" id="mesh-elm__1"><string name="filename" value="shell.ply"/><ref id="mat-itu_concrete.002"/></shape>
<shape type="ply" id="mesh-elm__2"><string name="filename" value="desk [3].ply"/><ref id="mat-absorber"/></shape>
</scene>
"""


@pytest.fixture
def run(command, tmp_path, monkeypatch):
    """Function: words after ``bisplat scene`` -> exit status, stdout, stderr, in a folder with room.xml."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(scene_drawing, "draw_scene", lambda scene, path: path.write_bytes(b"a drawing"))
    box((0, 0, 0), (5, 4, 3)).export("shell.ply")
    box((1, 1, 0.2), (2.4, 1.6, 0.6)).export("desk [3].ply")
    (tmp_path / "room.xml").write_text(XML)

    return partial(command, "scene")


def test_list_needs_no_antennas_and_writes_nothing(run, tmp_path):
    before = sorted(tmp_path.iterdir())
    status, out, err = run("room.xml", "--list", "--material", "desk [3]=wood", "--unit", "cm", "--json")
    listing = json.loads(out)
    shell, desk = listing["parts"]
    assert (shell["name"], shell["mesh file"], shell["material"]) == ("elm__1", "shell", "concrete")
    assert (desk["material"], desk["by"]) == ("wood", 'the rule "desk [3]=wood"')
    assert shell["size"] == [0.05, 0.04, 0.03] and shell["triangles"] == 12
    assert shell["area"] == pytest.approx(94e-4) and listing["bounds"]["mm"]["size"] == [0.005, 0.004, 0.003]
    assert (status, err, sorted(tmp_path.iterdir())) == (0, "", before)


def test_list_names_what_has_no_material_and_rules_that_never_count(run):
    status, out, err = run("room.xml", "--list", "--material", "*shell*=brick", "shell=wood", "door=wood")
    assert status == 0 and "nothing: add --material" in out and '"*shell*=brick"' in out
    assert '"shell=wood" never counts' in err and '"door=wood" matches no object' in err


def test_own_material_and_what_was_assumed(run, tmp_path):
    words = ("--own-material", "absorber=1.2,0.3,0.1", "--frequency", "3.5 GHz", "-o", "room", *PLACE)
    status, _, err = run("room.xml", *words)
    place = load_scene("room/scene.yaml")
    assert [each.material for each in place.objects] == ["concrete", "absorber"] and place.frequency == 3.5e9
    absorber = place.materials["absorber"]
    assert (absorber.relative_permittivity, absorber.conductivity, absorber.thickness) == (1.2, 0.3, 0.1)
    read, taken, thickness = err.splitlines()
    assert "up axis z" in read and "concrete (elm__1)" in taken and "thickness of 0.1 m" in thickness
    assert status == 0 and (tmp_path / "room/scene.png").read_bytes() == b"a drawing"


def test_the_shift_is_written_down(run, tmp_path):
    status, _, err = run("room.xml", "--default-material", "wood", "--shift", "10", "-20", "0.5", "-o", "room", *PLACE)
    assert status == 0 and "and unit m, shifted by 10 -20 0.5 m" in err
    assert json.loads((tmp_path / "room/import.json").read_text()) == {
        **{"file": "room.xml", "up": "z", "unit": "m", "frequency": 915e6, "shift": [10, -20, 0.5]},
        **{"walls": "as-sheets", "flatten": None},
    }
    assert load_scene("room/scene.yaml").gateway.position == (14.7, -18, 2.3)


DISK = OSError(errno.ENOSPC, "No space left on device")


@pytest.mark.parametrize("error", [ValueError("argmax of an empty sequence"), MemoryError("17 GiB"), DISK])
def test_a_drawing_that_fails_is_one_sentence_and_the_scene_is_kept(run, monkeypatch, tmp_path, error):
    def fail(*given):
        raise error

    monkeypatch.undo()
    monkeypatch.chdir(tmp_path)
    at = "write_atomically" if error is DISK else "_figure"
    monkeypatch.setattr(scene_drawing, at, fail)
    status, out, err = run("room.xml", "--default-material", "wood", "--frequency", "1e9", "-o", "room", *PLACE)
    assert status == 0 and load_scene("room/scene.yaml").name == "room" and "drawing: " not in out
    last = err.splitlines()[-1]
    assert last.startswith("bisplat: warning: room/scene.png: ") and str(error.args[-1]) in last
    assert last.endswith("; the scene itself is complete")
    status, _, err = run("room/scene.yaml", "-o", "x.png")
    assert status == 1 and str(error.args[-1]) in err and "Traceback" not in err


WRONG = {
    "megahertz": (["--frequency", "915"], "--frequency: expected hertz, .* 915 MHz are 915e6"),
    "two values": (["--own-material", "wet=5,0.1"], "--own-material: expected NAME="),
    "no number": (["--own-material", "wet=5,0.1,1_0"], "--own-material: expected NAME="),
    "no name": (["--own-material", "5,0.1,0.1"], "--own-material: expected NAME="),
    "out of range": (["--own-material", "wet=0.5,0.1,0.1"], '--own-material: material "wet": relative_permittivity: '),
    "no material": (["--material", "shell"], "--material: expected NAME=MATERIAL, found 'shell'"),
    "a shift of NaN": (["--shift", "nan", "0", "0"], "--shift: expected .*finite"),
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_values(run, case, tmp_path):
    words, sentence = WRONG[case]
    status, out, err = run("room.xml", "--default-material", "wood", "-o", "room", *PLACE, *words)
    assert status == 1 and out == "" and err.count("\n") == 1 and not (tmp_path / "room").exists()
    assert re.search(sentence, err), err
