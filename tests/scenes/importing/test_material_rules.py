"""Every name in a file can be used in a rule, the first rule counts, and rules that never count are named."""

import shlex
from pathlib import Path

import pytest

from scenes.files.errors import InputError
from scenes.importing.formats.mesh_part import ImportedFile, ImportedPart
from scenes.importing.material_rules import choose_materials, require_materials, rule_warnings, stated_materials
from scenes.scene.materials import RadioMaterial
from scenes.scene.shapes import box

MESH = box((0, 0, 0), (1, 1, 1))
PARTS = [
    ImportedPart("Facade.001/Glass_tinted.002", MESH, "Facade.001", "Glass_tinted.002"),
    ImportedPart("Facade.001/Concrete", MESH, "Facade.001", "Concrete"),
    ImportedPart("Object [346660]", MESH, "Object [346660]"),
    ImportedPart("elm__7", MESH, "elm__7", "mat-absorber", mesh_file="roof"),
]
FILE = ImportedFile(Path("block.glb"), PARTS, "y")
FOAM = RadioMaterial("foam", 1.05, 1e-4, 0.05)


def chosen(*rules, default=None, own=None, frequency=2.4e9, file=FILE):
    """The material of each part, "-" if it has none."""
    choices = choose_materials(file, [tuple(rule.rsplit("=", 1)) for rule in rules], default, frequency, own or {})
    return [choice.material.name if choice.material else "-" for choice in choices]


NAMES = {
    "Facade.001/Glass_tinted.002": 0,  # the part
    "Facade/Glass_tinted": 0,  # without Blender's numbers
    "Glass_tinted.002": 0,  # the material in the file
    "Glass_tinted": 0,
    "*tinted": 0,
    "Object [346660]": 2,  # literally, though it is a pattern too
    "Object ?346660?": 2,
    "mat-absorber": 3,  # the id of a bsdf
    "absorber": 3,
    "roof": 3,  # the mesh file that a scene XML names
    "elm__7": 3,
}


@pytest.mark.parametrize("name", NAMES)
def test_names_of_a_part(name):
    expected = ["wood", "concrete", "wood", "wood"]
    expected[NAMES[name]] = "metal"
    assert chosen(f"{name}=metal", "Facade.001/Concrete=concrete", "*=wood") == expected


FIRST = [
    *((f"{name}=brick *=wood", "brick brick wood wood") for name in ("Facade", "Facade.001", "Facade*")),
    ("Glass*=glass Facade=brick *=wood", "glass brick wood wood"),  # whatever its kind of name
    ("Facade=brick Glass*=glass *=wood", "brick brick wood wood"),
    ("block=brick roof=wood", "brick brick brick wood"),  # the name of the file comes last
]


@pytest.mark.parametrize(("rules", "expected"), FIRST)
def test_the_first_rule_counts_and_a_node_stands_for_its_parts(rules, expected):
    assert chosen(*rules.split()) == expected.split()


def test_a_material_that_the_file_names_comes_after_rules_and_before_the_default():
    assert chosen(default="wood") == ["wood", "concrete", "wood", "wood"]
    assert chosen("*=metal", default="wood") == ["metal"] * 4
    choices = choose_materials(FILE, [], "wood", 2.4e9, {})
    (stated,) = stated_materials(FILE, choices)
    assert stated.endswith(": concrete (Facade.001/Concrete)")
    assert stated_materials(FILE, choose_materials(FILE, [("*", "wood")], None, 2.4e9, {})) == []


def test_own_materials_in_rules_and_by_the_file():
    absorber = RadioMaterial("absorber", 1.2, 0.3, 0.1)
    own = {"foam": FOAM, "absorber": absorber}
    assert chosen("Facade=foam", default="wood", own=own) == ["foam", "foam", "wood", "absorber"]
    tinted = {"concrete": RadioMaterial("concrete", 7.0, 0.1, 0.3)}
    (_, concrete, *_) = choose_materials(FILE, [], "wood", 2.4e9, tinted)
    assert concrete.material == tinted["concrete"]  # the user's values before those of P.2040


def test_a_material_out_of_range_can_be_given_as_the_sentence_says():
    choices = choose_materials(FILE, [("*", "wet_ground")], None, 28e9, {})
    with pytest.raises(InputError, match=r"block.glb: material \"wet_ground\": .* found 28 GHz; ") as refusal:
        require_materials(FILE, choices)
    assert str(refusal.value).endswith(" --own-material wet_ground=PERMITTIVITY,CONDUCTIVITY,THICKNESS")
    own = {"wet_ground": RadioMaterial("wet_ground", 8.0, 11.0, 1.0)}
    assert chosen("*=wet_ground", own=own, frequency=28e9) == ["wet_ground"] * 4


@pytest.mark.parametrize("name", ["-x", "it's", 'a "b"', "a=b", "$HOME", "Object [3]", "x;ls"])
def test_the_rule_that_a_refusal_proposes_works_in_a_shell(name):
    file = ImportedFile(Path("x.obj"), [ImportedPart(name, MESH, name)], "z")
    with pytest.raises(InputError, match="expected a material for every object") as refusal:
        require_materials(file, choose_materials(file, [], None, 2.4e9, {}))
    proposal = str(refusal.value).split("such as --material ")[1].split(", or --default-material")[0]
    (rule,) = shlex.split(proposal)
    assert chosen(rule.replace("MATERIAL", "wood"), file=file) == ["wood"]


def test_rules_that_never_count():
    rules = [("Facade", "brick"), ("*", "wood"), ("*tinted", "glass"), ("roof", "metal"), ("door", "wood")]
    tinted, roof, door = rule_warnings(FILE, rules)
    assert '"*tinted=glass"' in tinted and '"Facade=brick"' in tinted
    assert '"roof=metal"' in roof and '"*=wood"' in roof
    assert '"door=wood" matches no object' in door and "Object [346660], elm__7" in door
    assert rule_warnings(FILE, rules[:2]) == []


def test_unknown_materials():
    with pytest.raises(InputError, match=r'block.glb: unknown material "fom"; did you mean "foam"'):
        chosen("*=fom", own={"foam": FOAM})
