"""A scene on disk: it comes back equal, and every mistake in it is told with its place."""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from scenes.checks.occupancy import element_positions
from scenes.checks.validation import validate
from scenes.files.errors import InputError
from scenes.files.output_folder import locked
from scenes.scene.materials import RadioMaterial, p2040_material
from scenes.scene.shapes import box
from scenes.storage.scene_writing import write_scene
from scenes.storage.scene_yaml import load_scene, read_scene

YARD = """\
name: outdoors
frequency: 915 MHz
gateway:
  position: [4, 0, 1]
  orientation: [0.5, -0.5, -0.5, 0.5]
transmitter:
  region: {min: [-1, -1, 0.5], max: [1, 1, 1.5]}
materials:
  felt: {relative_permittivity: 1.3, conductivity: 1e-3, thickness: 0.01}
  block: {p2040: concrete, thickness: 0.3, scattering_coefficient: 0.2}
objects:
  - {name: crate, mesh: crate.obj, material: wood}
  - {name: wall, mesh: wall.stl, material: block}
  - {name: mat, mesh: mat.ply, material: felt, thickness: 0.02}
"""


@pytest.fixture
def folder(tmp_path) -> Path:
    box((0, 0, 0.1), (1, 1, 0.4)).export(tmp_path / "crate.obj")
    box((-5, 3, 0.1), (5, 3.2, 3)).export(tmp_path / "wall.stl")
    box((-5, -5, 0), (5, 5, 0.05)).export(tmp_path / "mat.ply")
    return tmp_path


def read(folder: Path, text: str):
    (folder / "outdoors.yaml").write_text(text)
    return load_scene(str(folder / "outdoors.yaml"))


def test_reads_every_key(folder):
    scene = read(folder, YARD)
    assert (scene.name, scene.frequency) == ("outdoors", 915e6)
    assert scene.gateway.position == (4, 0, 1) and scene.gateway.rows == 4 and scene.gateway.pattern == "iso"
    assert scene.transmitter.region_max == (1, 1, 1.5)
    assert [o.name for o in scene.objects] == ["crate", "wall", "mat"]
    assert scene.objects[2].thickness == 0.02 and scene.objects[0].thickness is None
    assert set(scene.materials) == {"wood", "block", "felt"}
    assert scene.materials["felt"].conductivity == 1e-3
    block = scene.materials["block"]
    assert (block.name, block.thickness, block.scattering_coefficient) == ("block", 0.3, 0.2)
    assert block.conductivity == pytest.approx(0.0462 * 0.915**0.7822)
    np.testing.assert_allclose(scene.objects[0].mesh.bounds, [[0, 0, 0.1], [1, 1, 0.4]])


def test_reads_antenna_options(folder):
    text = YARD.replace("[4, 0, 1]\n", "[4, 0, 1]\n  rows: 2\n  columns: 8\n  spacing: 0.4\n  pattern: tr38901\n")
    text = text.replace("1.5]}\n", "1.5]}\n  pattern: dipole\n  polarization: H\n  orientation: [0, 0, 0.6, 0.8]\n")
    scene = read(folder, text)
    gateway, transmitter = scene.gateway, scene.transmitter
    assert (gateway.rows, gateway.columns, gateway.spacing, gateway.pattern) == (2, 8, 0.4, "tr38901")
    assert (transmitter.pattern, transmitter.polarization) == ("dipole", "H")
    assert transmitter.orientation == pytest.approx((0, 0, 0.6, 0.8))


def test_gltf_is_y_up(folder):
    box((0, 0, 0), (1, 2, 3)).export(folder / "crate.glb")
    scene = read(folder, YARD.replace("crate.obj", "crate.glb"))
    np.testing.assert_allclose(scene.objects[0].mesh.bounds, [[0, -3, 0], [1, 0, 2]], atol=1e-6)


def test_what_a_mesh_has_besides_surfaces_is_said(folder, capsys):
    with (folder / "crate.obj").open("a") as file:
        file.write("l 1 2\n")
    read(folder, YARD)
    assert '("crate"): mesh: lines were left out: 1 in the file' in capsys.readouterr().err


def test_round_trip_is_exact(scene, tmp_path):
    path = write_scene(scene, tmp_path / "out")
    assert path == tmp_path / "out" / "scene.yaml"
    assert read_scene(path) == scene
    lab = load_scene("lab")
    assert read_scene(write_scene(lab, tmp_path / "lab")) == lab


def test_given_elements_are_read_and_written_and_stay_in_metres(scene, tmp_path):
    places = ((0.0, 0.0, 0.0), (0.1, 0.02, 0.0), (-0.1, 0.0, 0.03))
    given = replace(scene, gateway=replace(scene.gateway, elements=places))
    written = write_scene(given, tmp_path)
    assert read_scene(written) == given and "rows" not in written.read_text()
    other = given.at_frequency(2.4e9)
    np.testing.assert_array_equal(
        element_positions(other.gateway, other.wavelength), element_positions(given.gateway, given.wavelength)
    )
    assert given.with_array(2, 8).gateway.elements is None and given.with_array(2, 8).gateway.count == 16
    assert scene.with_array(2, 8).with_elements(places).gateway == replace(scene.gateway, elements=places)


def test_what_was_given_by_hand_stays_when_the_frequency_changes(scene, tmp_path):
    wall = p2040_material("concrete", 915e6, thickness=0.4, scattering_coefficient=0.2)
    foam = RadioMaterial("wood", 1.05, 1e-4, 0.05)
    mine = replace(scene, materials={"concrete": wall, "wood": foam})
    path = write_scene(mine, tmp_path)
    assert read_scene(path) == mine
    path.write_text(path.read_text().replace("frequency: 915000000.0\ngateway", "frequency: 2.4 GHz\ngateway"))
    moved = read_scene(path).materials
    assert (moved["concrete"].thickness, moved["concrete"].scattering_coefficient) == (0.4, 0.2)
    assert moved["concrete"].conductivity == p2040_material("concrete", 2.4e9).conductivity
    assert moved["wood"] == foam and moved["wood"].frequency == 915e6


def test_values_for_another_frequency_are_said(folder, capsys):
    read(folder, YARD)
    assert not capsys.readouterr().err
    read(folder, YARD.replace("conductivity: 1e-3", "conductivity: 1e-3, frequency: 2.4 GHz"))
    assert "felt" in (said := capsys.readouterr().err) and "2400 MHz" in said


def test_a_scene_that_is_read_and_written_again_has_the_same_bytes(folder, tmp_path):
    """Materials stay in the order of the file, not in that in which objects use them; P.2040's follow."""
    last_first = YARD.replace("  felt:", "  mine: {p2040: brick}\n  felt:")  # which no object has
    for given in (read(folder, last_first), load_scene("closet"), load_scene("lab"), load_scene("bedroom")):
        first = write_scene(given, tmp_path / given.name)
        again = write_scene(read_scene(first), tmp_path / f"{given.name} again")
        files, same = (
            {str(p.relative_to(each.parent)): p.read_bytes() for p in each.parent.rglob("*.*")}
            for each in (first, again)
        )
        assert files == same and len(files) == 1 + len(given.objects)  # and nothing temporary
    assert list(read(folder, last_first).materials) == ["felt", "block", "wood"]
    more = replace(given, materials=given.materials | {"unused": next(iter(given.materials.values()))})
    assert write_scene(more, tmp_path / "more").read_bytes() == first.read_bytes()


def test_names_that_are_no_file_names(scene, tmp_path):
    floor, crate = scene.objects
    names = ["a/b", "A b", "a_b", "a_b_1", "é", "É", "...", "!!!", "2024-01-01", "-.5", "yes", "{a: b}", "ü" * 200]
    crates = tuple(replace(crate, name=name) for name in names)
    crates += tuple(replace(crate, name="!" * (number + 1)) for number in range(10, 160))
    awkward = replace(scene, name="- #1: 'x", objects=(floor, *crates))
    path = write_scene(awkward, tmp_path)
    assert read_scene(path) == awkward
    assert sum(len(each.name) > 20 for each in (path.parent / "meshes").iterdir()) == 1  # of the 200 letters


def test_never_overwrites(scene, tmp_path):
    (tmp_path / "scene.yaml").write_text("mine")
    with pytest.raises(InputError, match=r"scene\.yaml: expected no file of this name, found one"):
        write_scene(scene, tmp_path)
    assert (tmp_path / "scene.yaml").read_text() == "mine"
    assert not (tmp_path / "meshes").exists()


def test_never_overwrites_a_mesh_but_continues_its_own(scene, tmp_path):
    write_scene(scene, tmp_path / "whole")
    (tmp_path / "begun" / "meshes").mkdir(parents=True)
    begun, floor = (tmp_path / name / "meshes" / "floor.ply" for name in ("begun", "whole"))
    begun.write_text("mine")
    with pytest.raises(InputError, match=r"floor\.ply: .* found one; .* never overwritten, so give another folder"):
        write_scene(scene, tmp_path / "begun")
    assert begun.read_text() == "mine" and len([*(tmp_path / "begun").rglob("*")]) == 2
    begun.write_bytes(floor.read_bytes())  # of a write that was killed
    assert read_scene(write_scene(scene, tmp_path / "begun")) == scene


def test_folder_is_claimed_before_anything_is_written(scene, tmp_path):
    with locked(tmp_path / "both"), pytest.raises(InputError, match="no other process writes to"):
        write_scene(scene, tmp_path / "both")
    assert not [*(tmp_path / "both").iterdir()]
    write_scene(scene, tmp_path / "both")


def test_what_is_no_file_is_not_replaced(scene, tmp_path):
    (tmp_path / "a" / "scene.yaml").mkdir(parents=True)
    (tmp_path / "b" / "meshes").mkdir(parents=True)
    os.mkfifo(tmp_path / "b" / "meshes" / "floor.ply")
    (tmp_path / "c").write_text("a file")
    for name, sentence in (("a", "found a folder"), ("b", "found a named pipe"), ("c", "expected a folder")):
        with pytest.raises(InputError, match=sentence):
            write_scene(scene, tmp_path / name)


BAD = [
    # what to replace, by what, and what the sentence has to have: the place, what was found, what was perhaps meant
    ("frequency: 915 MHz\n", "", "outdoors.yaml: ", "frequency"),
    ("915 MHz", "915 MHzz", "outdoors.yaml: frequency", "'915 MHzz'"),
    ("915 MHz", "400 MHz", "outdoors.yaml: materials.block", '"concrete"', "0.4 GHz"),
    ("gateway:", "gatway:", "outdoors.yaml: ", "'gatway'", '"gateway"'),
    ("  position: [4, 0, 1]\n", "", "outdoors.yaml: gateway", "position"),
    ("[4, 0, 1]", "[4, 0]", "outdoors.yaml: gateway.position", "3", "[4, 0]"),
    ("[4, 0, 1]", f"[4, 0, {'9' * 400}]", "outdoors.yaml: gateway.position[2]", "99"),
    ("[4, 0, 1]", "[4, 0, 1]\n  rows: 4.5", "outdoors.yaml: gateway.rows", "4.5"),
    ("[4, 0, 1]", "[4, 0, 1]\n  row: 4", "outdoors.yaml: gateway", "'row'", '"rows"'),
    ("[4, 0, 1]", "[4, 0, 1]\n  elements: []", "outdoors.yaml: gateway.elements", "found 0"),
    ("[4, 0, 1]", "[4, 0, 1]\n  elements: [[0, 0]]", "outdoors.yaml: gateway.elements[0]", "[0, 0]"),
    ("[4, 0, 1]", "[4, 0, 1]\n  elements: [[0, 0, 0], [0, 0, 0]]", "outdoors.yaml: gateway.elements", "0 and 1"),
    ("[4, 0, 1]", "[4, 0, 1]\n  elements: [[0, 0, 160]]", "outdoors.yaml: gateway.elements", "160", "in metres"),
    ("[4, 0, 1]", "[4, 0, 1]\n  elements: [[0, 0, 0]]\n  rows: 4", "outdoors.yaml: gateway.elements", "and rows"),
    ("max: [1, 1, 1.5]", "size: [1, 1, 1]", "outdoors.yaml: transmitter.region", "'size'", "max"),
    ("  region: {min: [-1, -1, 0.5], max: [1, 1, 1.5]}\n", "", "outdoors.yaml: transmitter", "nothing"),
    ("conductivity: 1e-3, ", "", "outdoors.yaml: materials.felt", "conductivity"),
    ("p2040: concrete", "p2040: concret", "outdoors.yaml: materials.block", '"concret"', '"concrete"'),
    ("material: wood", "material: wod", 'outdoors.yaml: objects[0] ("crate")', '"wod"', '"wood"'),
    ("crate.obj", "../crate.obj", 'outdoors.yaml: objects[0] ("crate")', "'../crate.obj'"),
    ("crate.obj", "/etc/passwd.obj", 'outdoors.yaml: objects[0] ("crate")', "'/etc/passwd.obj'"),
    ("crate.obj", "pipe.obj", 'outdoors.yaml: objects[0] ("crate")', "pipe.obj", "named pipe"),
    ("  - {name: crate, mesh: crate.obj, material: wood}", "  - crate", "outdoors.yaml: objects[0]", "'crate'"),
    (YARD[YARD.index("objects:") :], "objects: {crate: 1}\n", "outdoors.yaml: objects", "{'crate': 1}"),
    (YARD, "", "outdoors.yaml: ", "nothing"),
    (YARD, "- a\n- b\n", "outdoors.yaml: ", "['a', 'b']"),
    ("name: outdoors", "name: &a outdoors\nmaterials: *a", "outdoors.yaml, line 2: ", "*a"),
    ("felt:", "? [felt]\n  :", "outdoors.yaml, line 9: "),
    ("[4, 0, 1]", "[4, 0, 1", "outdoors.yaml, line 5: "),
    ("name: outdoors", "name: outdoors\nname: garden", "outdoors.yaml, line 2: ", "'name'"),
]


@pytest.mark.parametrize(("old", "new", "facts"), [(old, new, facts) for old, new, *facts in BAD])
def test_mistakes(folder, old, new, facts):
    os.mkfifo(folder / "pipe.obj")
    assert old in YARD
    with pytest.raises(InputError) as caught:
        read(folder, YARD.replace(old, new))
    sentence = str(caught.value).removeprefix(f"{folder}/")
    assert sentence.startswith(facts[0]) and all(fact in sentence for fact in facts[1:]), sentence
    assert "\n" not in sentence


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("labb", 'unknown scene "labb"; did you mean "lab"'),
        ("nowhere/outdoors.yaml", "nowhere/outdoors.yaml: expected a scene, found no such file"),
        ("room.ifc", "room.ifc: expected a .yaml file, .*GLB.* or one of lab, .* found another kind of file"),
    ],
)
def test_unknown_scenes(name, sentence):
    with pytest.raises(InputError, match=sentence):
        load_scene(name)


def test_several_gateways_are_read_written_and_each_has_a_place_of_its_own(scene, tmp_path):
    second = replace(scene.gateway, position=(2.0, 0.5, 2.0), rows=8)
    both = replace(scene, further_gateways={"by-the-door": second})
    assert read_scene(write_scene(both, tmp_path)) == both
    seen = both.by_gateway()
    assert list(seen) == ["gateway1", "by-the-door"]
    assert seen["gateway1"] == scene
    assert seen["by-the-door"] == replace(scene, gateway=second)


@pytest.mark.parametrize("name", ["gateway1", "a/b", ""])
def test_gateway_needs_a_name_that_can_be_a_folder(name, scene):
    with pytest.raises(InputError, match="further_gateways: expected a name of letters, digits, - and _"):
        validate(replace(scene, further_gateways={name: scene.gateway}), "outdoors")


def test_further_gateway_inside_an_object_is_named(scene):
    with pytest.raises(InputError, match=r"further_gateways.second.position: .* found .* inside"):
        inside = replace(scene.gateway, position=(0.5, 0.5, 0.2))
        validate(replace(scene, further_gateways={"second": inside}), "outdoors")
