"""Scene files of Mitsuba and Sionna RT become the places they describe, or one sentence that says why not."""

from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from scenes.files import optional_packages
from scenes.files.errors import InputError
from scenes.importing import mitsuba_xml
from scenes.importing.formats.mesh_part import ImportedFile, ImportedPart
from scenes.importing.imported_file import read_file
from scenes.importing.imported_objects import import_objects
from scenes.importing.mesh_import import import_scene
from scenes.importing.mitsuba_xml import SIONNA, read_mitsuba, sionna_scene
from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.materials import RadioMaterial, p2040_material
from scenes.scene.orientation import facing
from scenes.scene.shapes import box
from scenes.storage.scene_writing import write_scene
from scenes.storage.scene_yaml import load_scene, read_scene

GHZ = 3.5e9
CONCRETE = '<bsdf type="diffuse" id="mat-itu_concrete"/>'
FILENAME = '<string name="filename" value="{}"/>'
needs_sionna = pytest.mark.skipif(find_spec("sionna") is None, reason="Sionna RT is not installed")


@pytest.fixture
def write(tmp_path):
    """Writes a scene of the given elements and returns its path."""

    def write(*elements: str) -> Path:
        path = tmp_path / "outdoors.xml"
        path.write_text(f'<scene version="2.1.0">{"".join(elements)}</scene>')
        return path

    return write


def import_mitsuba(path, frequency, rules=(), default=None, unit="m"):
    """The objects of a file, their materials, and the report."""
    return import_objects(read_file(path), rules, default, unit, "z", frequency)


def shape(inside="", kind="rectangle", name="mesh-wall"):
    return f'<shape type="{kind}" id="{name}">{inside}</shape>'


def moved(steps, inside=""):
    return shape(f'<transform name="to_world">{steps}</transform>{inside}')


def material(path, *rules, default=None, frequency=GHZ):
    """The material of the only shape."""
    (item,), materials, _ = import_mitsuba(path, frequency, rules, default)
    return materials[item.material]


RIGHT = [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]
TRANSFORMS = {
    "none": ("", RIGHT),
    "translate": ('<translate x="1" z="-2"/>', [[0, -1, -2], [2, -1, -2], [2, 1, -2], [0, 1, -2]]),
    # a quarter turn about z: (x, y) -> (-y, x)
    "rotate": ('<rotate z="2" angle="90"/>', [[1, -1, 0], [1, 1, 0], [-1, 1, 0], [-1, -1, 0]]),
    # about x: (y, z) -> (-z, y)
    "rotate by value": ('<rotate value="1 0 0" angle="90"/>', [[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]]),
    "scale": ('<scale x="3" y="0.5"/>', [[-3, -0.5, 0], [3, -0.5, 0], [3, 0.5, 0], [-3, 0.5, 0]]),
    "matrix": (
        '<matrix value="0 0 1 5  1 0 0 6  0 1 0 7  0 0 0 1"/>',  # (x, y, z) -> (z + 5, x + 6, y + 7)
        [[5, 5, 6], [5, 7, 6], [5, 7, 8], [5, 5, 8]],
    ),
    "matrix of nine": ('<matrix value="0 0 1 1 0 0 0 1 0"/>', [[0, -1, -1], [0, 1, -1], [0, 1, 1], [0, -1, 1]]),
    # moved by 1, turned (2, 1) -> (-1, 2), doubled, moved by 5, x doubled; Mitsuba 3.9 finds the box 6..14, 0..4, 7
    "in the order of the file": (
        '<translate x="1"/><rotate z="1" angle="90"/><scale value="2"/>'
        '<matrix value="1 0 0 5 0 1 0 0 0 0 1 0 0 0 0 1"/><scale x="2"/><translate value="0 0 7"/>',
        [[14, 0, 7], [14, 4, 7], [6, 4, 7], [6, 0, 7]],
    ),
}


@pytest.mark.parametrize("case", TRANSFORMS)
def test_transforms(write, case):
    steps, corners = TRANSFORMS[case]
    (wall,) = read_mitsuba(write(moved(steps)))
    assert wall.name == "wall"
    np.testing.assert_allclose(wall.mesh.vertices, corners, atol=1e-12)


def test_a_mirrored_cube_stays_the_right_way_out(write):
    (cube,) = read_mitsuba(write(moved('<scale x="-2"/>').replace("rectangle", "cube")))
    np.testing.assert_allclose(cube.mesh.bounds, [[-2, -1, -1], [2, 1, 1]])
    assert cube.mesh.is_watertight and cube.mesh.volume == pytest.approx(16)


def test_mesh_files_are_beside_the_xml(write, tmp_path):
    (tmp_path / "meshes").mkdir()
    box((0, 0, 0), (1, 2, 3)).export(tmp_path / "meshes/crate.ply")
    (tmp_path / "two.obj").write_text("o a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\no b\nv 0 0 9\nf 1 2 4\n")
    lift = '<transform name="to_world"><translate z="1"/></transform>'
    crate = shape(FILENAME.format("meshes/crate.ply") + lift, "ply", "crate")
    crate, two = read_mitsuba(write(crate, shape(FILENAME.format("two.obj"), "obj", "two")))
    np.testing.assert_allclose(crate.mesh.bounds, [[0, 0, 1], [1, 2, 4]])
    assert len(two.mesh.faces) == 2  # the groups of an OBJ are one shape
    np.testing.assert_allclose(two.mesh.bounds, [[0, 0, 0], [1, 1, 9]])


def test_defaults_replace_names(write):
    path = write(
        '<default name="w" value="2"/><default name="wide" value="$w"/><default name="kind" value="glass"/>',
        moved('<scale x="$wide" y="$w.5"/>', '<bsdf type="diffuse" id="mat-itu_$kind"/>'),
    )
    (wall,) = read_mitsuba(path)
    np.testing.assert_allclose(wall.mesh.extents, [4, 5, 0])
    assert material(path).name == "glass"


def test_what_is_no_shape_is_ignored(write):
    camera = '<integrator type="path"/><sensor type="perspective"><film type="hdrfilm"/></sensor>'
    light = '<emitter type="constant"/>'
    assert len(read_mitsuba(write(camera, light, shape('<emitter type="area"/>')))) == 1


def bsdf(kind, values, name="mat-screen"):
    floats = "".join(f'<float name="{key}" value="{value}"/>' for key, value in values.items() if key != "type")
    texts = f'<string name="type" value="{values["type"]}"/>' if "type" in values else ""
    return f'<bsdf type="{kind}" id="{name}">{texts}{floats}</bsdf>'


def test_radio_materials(write):
    values = {"type": "glass", "thickness": 0.02, "scattering_coefficient": 0.3, "xpd_coefficient": 0.1}
    glass = replace(p2040_material("glass", GHZ, thickness=0.02), scattering_coefficient=0.3, xpd_coefficient=0.1)
    found = material(write(shape(bsdf("itu-radio-material", values))))
    assert found == replace(glass, name="screen")
    values = {"relative_permittivity": 2.5, "conductivity": 0.04, "thickness": 0.3, "scattering_coefficient": 0.5}
    assert material(write(shape(bsdf("radio-material", values)))) == RadioMaterial("screen", **values)


def test_references_are_shared_and_thickness_is_sionnas_by_default(write):
    ref = '<ref id="mat-itu_concrete" name="bsdf"/>'
    path = write(CONCRETE, shape(ref, name="a"), shape(ref, name="a"))
    objects, materials, _ = import_mitsuba(path, GHZ, unit="cm")  # of the shapes; the thickness is in metres
    assert [(o.name, o.material) for o in objects] == [("a", "concrete"), ("a_2", "concrete")]
    assert list(materials) == ["concrete"] and materials["concrete"].thickness == 0.1


def test_rules_override_the_file_and_keep_the_name(write):
    metal = bsdf("itu-radio-material", {"type": "metal", "thickness": 0.5}, "metal")
    path = write(shape(metal, name="mesh-a"), shape(CONCRETE, name="b"), shape(name="c"))
    objects, materials, _ = import_mitsuba(path, GHZ, [("b", "metal")], "wood")
    assert [o.material for o in objects] == ["metal_2", "metal", "wood"]
    assert materials["metal"] == p2040_material("metal", GHZ) and materials["metal"].thickness != 0.5
    assert (materials["metal_2"].name, materials["metal_2"].thickness) == ("metal_2", 0.5)
    assert material(write(shape(bsdf("diffuse", {}, "mat-paint"))), default="brick").name == "brick"


def test_a_rule_saves_what_the_frequency_would_refuse(write):
    path = write(shape(bsdf("itu-radio-material", {"type": "floorboard"})))
    with pytest.raises(InputError, match=r'shape "wall": material "floorboard": .* 50 to 100 GHz, found 3.5 GHz'):
        import_mitsuba(path, GHZ)
    assert material(path, ("wall", "wood")).name == "wood"


REFUSED = {
    # the elements, and what the sentence has to have: the place, what was found, what was perhaps meant
    "sphere": (shape(kind="sphere"), 'shape "wall"', '"sphere"'),
    "missing mesh": (shape(FILENAME.format("gone.ply"), "ply"), 'shape "wall"', "gone.ply"),
    "lookat": (moved('<lookat origin="0 0 1"/>'), 'shape "wall"', "<lookat>"),
    "perspective": (moved('<matrix value="1 0 0 0 0 1 0 0 0 0 1 0 0 0 1 1"/>'), 'shape "wall"', "invertible affine"),
    "matrix of four": (moved('<matrix value="1 0 0 1"/>'), 'shape "wall"', "9 or 16", '"1 0 0 1"'),
    "not a number": (moved('<translate x="one"/>'), 'shape "wall"', '"one"'),
    "no bsdf": (shape(), "found none for wall"),
    "misspelt id": (shape('<bsdf type="diffuse" id="mat-itu_bric"/>'), '"bric"', '"brick"'),
    "unknown type": (shape(bsdf("itu-radio-material", {"type": "vacuum"})), 'shape "wall"', "mat-screen", '"vacuum"'),
    "unknown property": (shape(bsdf("radio-material", {"permittivity": 3})), '"permittivity"'),
    "dangling reference": (CONCRETE + shape('<ref id="mat-itu_concret"/>'), '"mat-itu_concrete"'),
    "two materials": (shape(CONCRETE + CONCRETE), 'shape "wall"', "bsdf", "2"),
    "undefined name": (moved('<scale value="$size"/>'), "<scale>", '"$size"'),
    "include": ('<include filename="more.xml"/>', "<include>"),
    "no shapes": (CONCRETE, "shape"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_refusals(write, case):
    elements, *facts = REFUSED[case]
    with pytest.raises(InputError) as refusal:
        import_mitsuba(write(elements), GHZ)
    sentence = str(refusal.value)
    assert all(fact in sentence for fact in ("outdoors.xml: ", *facts)) and "\n" not in sentence, sentence


@pytest.mark.parametrize("name", ["outdoors.xml", "sionna:etoile"])
def test_load_scene_says_to_import_it_first(name):
    with pytest.raises(InputError, match=f"{name}: .* bisplat scene {name} -o FOLDER"):
        load_scene(name)


@needs_sionna
def test_built_in_scenes_of_sionna(monkeypatch):
    # Meshes of a city take seconds to read, and etoile's are read below: here only whether each is there.
    cube = ImportedPart("", box((0, 0, 0), (1, 1, 1)))
    monkeypatch.setattr(mitsuba_xml, "read_mesh_file", lambda path: ImportedFile(path, [cube] * path.is_file(), "z"))
    names = {path.parent.name for path in sionna_scene(f"{SIONNA}box").parents[1].glob("*/*.xml")}
    assert len(names) >= 15 and "san_francisco" in names
    for name in names:
        assert all(each.radio_material(GHZ, {}).conductivity > 0 for each in read_mitsuba(sionna_scene(SIONNA + name)))


@pytest.mark.slow
@needs_sionna
def test_etoile_end_to_end(tmp_path):
    gateway = Gateway((0.0, -150.0, 30.0), facing((0.0, 1.0, 0.0)))
    region = Transmitter((-50.0, -50.0, 1.0), (-20.0, -20.0, 2.0))
    rules = [("Plane", "medium_dry_ground")]
    scene, report = import_scene("sionna:etoile", rules, frequency=GHZ, gateway=gateway, transmitter=region)
    assert scene.name == "etoile" and len(scene.objects) == len(report.sizes) == 565
    assert set(scene.materials) == {"medium_dry_ground", "marble", "metal", "wood", "concrete"}
    assert scene.materials["marble"] == p2040_material("marble", GHZ, thickness=0.1)
    assert {o.name: o.material for o in scene.objects}["Plane"] == "medium_dry_ground"
    np.testing.assert_allclose(scene.bounds, [[-426.83, -338.06, 0], [426.83, 338.06, 50]], atol=0.01)
    assert read_scene(write_scene(scene, tmp_path / "etoile")) == scene


def test_scenes_of_sionna_need_its_package(monkeypatch):
    monkeypatch.setattr(optional_packages, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"the scene sionna:etoile needs Sionna RT, which is not installed"):
        sionna_scene("sionna:etoile")
