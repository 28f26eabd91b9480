"""ITU-R P.2040 against the recommendation and against Sionna's copy of it."""

import ast
import importlib.util
from dataclasses import replace
from pathlib import Path

import pytest

from scenes.files.errors import InputError
from scenes.scene.materials import P2040, RadioMaterial, p2040_material, p2040_source


@pytest.mark.parametrize(
    ("name", "permittivity", "conductivity"),
    [
        # At 2.4 GHz by hand from P.2040-3, Table 3.
        ("concrete", 5.24, 0.0462 * 2.4**0.7822),
        ("brick", 3.91, 0.0238 * 2.4**0.16),
        ("glass", 6.31, 0.0036 * 2.4**1.3394),
        ("metal", 1.0, 1e7),
        ("wet_ground", 30 * 2.4**-0.4, 0.15 * 2.4**1.3),
    ],
)
def test_power_law(name, permittivity, conductivity):
    material = p2040_material(name, 2.4e9)
    assert material.relative_permittivity == pytest.approx(permittivity)
    assert material.conductivity == pytest.approx(conductivity)
    assert material.name == name and material.thickness > 0


def test_table_is_sionnas():
    """Every row is among Sionna's, read from its source so that no ray tracer starts."""
    package = importlib.util.find_spec("sionna")
    if package is None or not package.submodule_search_locations:
        pytest.skip("sionna is not installed")
    source = Path(package.submodule_search_locations[0], "rt", "radio_materials", "itu.py").read_text()
    table = next(
        ast.literal_eval(node.value)
        for node in ast.parse(source).body
        if isinstance(node, ast.Assign) and node.targets[0].id == "ITU_MATERIALS_PROPERTIES"
    )
    for name, row in P2040.items():
        assert table[name][row.range_ghz] == (row.a, row.b, row.c, row.d), name


def test_every_material_covers_915_mhz_but_floorboard():
    for name in set(P2040) - {"floorboard"}:
        p2040_material(name, 915e6)
    with pytest.raises(InputError, match=r'"floorboard": .* 50 to 100 GHz, found 0\.915 GHz'):
        p2040_material("floorboard", 915e6)


@pytest.mark.parametrize(("inside", "outside"), [(0.9e9, 0.89e9), (110e9, 111e9)])
def test_extrapolates_to_ten_percent(inside, outside):
    p2040_material("concrete", inside)
    with pytest.raises(InputError, match="1 to 100 GHz, found"):
        p2040_material("concrete", outside)


@pytest.mark.parametrize("frequency", [915e6, 2.4e9, 3.5e9, 5.8e9, 28e9])
def test_source_is_found_by_the_values(frequency):
    for name in P2040:
        if P2040[name].covers(frequency):
            material = replace(p2040_material(name, frequency), name="mine", thickness=0.5)
            assert p2040_source(material, frequency) == name
            assert p2040_source(replace(material, relative_permittivity=9.0), frequency) is None


def test_frequency_of_a_material_counts_neither_in_comparisons_nor_in_a_scenes_digest():
    felt = RadioMaterial("felt", 1.3, 0.0, 0.01)
    assert replace(felt, frequency=1e9) == felt and str(replace(felt, frequency=1e9)) == str(felt)
    with pytest.raises(InputError, match=r'"felt": frequency: expected a positive number of hertz, found -1'):
        replace(felt, frequency=-1)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("relative_permittivity", 0.5),
        ("relative_permittivity", 1e9),
        ("conductivity", -1.0),
        ("thickness", float("nan")),
        ("scattering_coefficient", 1.5),
        ("color", (0.0, 0.0, 2.0)),
    ],
)
def test_impossible_values(key, value):
    good = {"name": "felt", "relative_permittivity": 1.3, "conductivity": 0.0, "thickness": 0.01}
    with pytest.raises(InputError, match=f'"felt".*{key}'):
        RadioMaterial(**(good | {key: value}))
