"""The conventions of the dataclasses and everything `validate` refuses."""

from dataclasses import replace

import numpy as np
import pytest
from trimesh import Trimesh

from scenes.checks.validation import doubts, validate
from scenes.files.errors import InputError, ParameterError
from scenes.scene.antennas import Gateway, read_array
from scenes.scene.description import SceneObject, shifted
from scenes.scene.materials import RadioMaterial
from scenes.scene.shapes import box


def test_wavelength_and_bounds(scene):
    assert scene.wavelength == pytest.approx(0.32764, abs=1e-5)
    np.testing.assert_allclose(scene.bounds, [[-5, -5, 0], [5, 5, 1 / 3]])


def test_materials_of_the_recommendation_follow_the_frequency_and_others_are_doubted(scene):
    own = RadioMaterial("foam", 1.1, 1e-4, 0.1)
    thin = replace(scene.materials["concrete"], thickness=0.07, color=(0, 0, 1), scattering_coefficient=0.2)
    room = replace(scene, materials={**scene.materials, "concrete": thin, "foam": own})
    wifi = room.at_frequency("2.4GHz")
    assert wifi.wavelength == pytest.approx(299792458 / 2.4e9)
    concrete = wifi.materials["concrete"]
    assert concrete.conductivity == pytest.approx(0.0462 * 2.4**0.7822)  # ITU-R P.2040-3, Table 3
    assert (concrete.thickness, concrete.color, concrete.scattering_coefficient) == (0.07, (0, 0, 1), 0.2)
    assert wifi.materials["foam"] == own and len(doubts(room)) == 0
    (doubt,) = doubts(wifi)
    assert '"foam"' in doubt and "915 MHz" in doubt and "2400 MHz" in doubt
    back = wifi.at_frequency(915e6)
    assert back == room and doubts(back) == []


def test_every_gateway_gets_the_array(scene):
    several = replace(scene, further_gateways={"door": replace(scene.gateway, rows=2, spacing=0.3)})
    both = several.with_array(8, 2).by_gateway().values()
    assert [(s.gateway.rows, s.gateway.columns, s.gateway.spacing) for s in both] == [(8, 2, 0.5), (8, 2, 0.3)]
    assert several.with_array(1, 16, 0.25).further_gateways["door"].spacing == 0.25


@pytest.mark.parametrize("text", ["8", "8x", "8x8@", "8x8@half", "-1x4", "8x8x8", "", "8.5x2"])
def test_the_size_of_an_array_is_understood_or_refused(text):
    assert read_array("4x2@.491") == (4, 2, 0.491) and read_array("16×1") == (16, 1, None)
    with pytest.raises(ParameterError, match="expected ROWSxCOLUMNS"):
        read_array(text)


def test_region_corners(scene):
    corners = scene.transmitter.corners()
    assert len(np.unique(corners, axis=0)) == 8
    np.testing.assert_allclose([corners.min(axis=0), corners.max(axis=0)], [[-1, -1, 0.5], [1, 1, 1.5]])


def test_published_quaternion_is_normalised():
    gateway = Gateway((0, 0, 0), (0.513, -0.487, -0.487, 0.513))
    assert np.linalg.norm(gateway.orientation) == pytest.approx(1, abs=1e-12)


def test_materials_may_be_for_a_frequency_nearby_or_given_by_hand(scene):
    validate(replace(scene, frequency=868e6), "outdoors.yaml")
    concrete = replace(scene.materials["concrete"], conductivity=0.02)
    validate(replace(scene, frequency=2.4e9, materials={"concrete": concrete, "wood": concrete}), "outdoors.yaml")


def test_objects_compare_by_value():
    def crate(height: float = 1.0) -> SceneObject:
        return SceneObject("crate", box((0, 0, 0), (1, 1, height)), "wood")

    assert crate() == crate() and hash(crate()) == hash(crate())
    assert crate() != crate(2.0)


def test_what_is_computed_once_is_computed_anew_for_a_changed_scene(scene):
    assert scene.bounds is scene.bounds and len(scene.objects[1].closed_parts) == 1
    with pytest.raises(ValueError, match="read-only"):
        scene.bounds[0] += 1
    taller = replace(scene, objects=(replace(scene.objects[1], mesh=box((0, 0, 0), (1, 1, 7))),))
    assert taller.bounds[1, 2] == 7 and taller.objects[0].closed_parts[0].bounds[1, 2] == 7


def test_a_shifted_scene_is_the_same_elsewhere(scene):
    both = replace(scene, further_gateways={"low": replace(scene.gateway, position=(4.0, 1.0, 0.7))})
    step = np.array([1000.0, -20.0, 3.0])
    there = shifted(both, step)
    np.testing.assert_allclose(there.bounds, both.bounds + step)
    np.testing.assert_allclose(there.transmitter.region, both.transmitter.region + step)
    np.testing.assert_allclose(there.further_gateways["low"].position, np.array([4.0, 1.0, 0.7]) + step)
    np.testing.assert_allclose(shifted(there, -step).extent, both.extent)
    validate(there, "there")
    np.testing.assert_allclose(both.bounds, scene.bounds)  # not moved


def gateway(**changes):
    return lambda s: replace(s, gateway=replace(s.gateway, **changes))


def transmitter(**changes):
    return lambda s: replace(s, transmitter=replace(s.transmitter, **changes))


def second_object(item):
    return lambda s: replace(s, objects=(s.objects[0], item))


BOX = box((0, 0, 0), (1, 1, 1))
MANY = Trimesh(BOX.vertices, np.tile(BOX.faces[:1], (1_000_000, 1)), process=False)
FAR = Trimesh(BOX.vertices * 1e6, BOX.faces, process=False)
NAN = Trimesh([[0, 0, 0], [1, 0, 0], [0, np.nan, 0]], [[0, 1, 2]], process=False)


@pytest.mark.parametrize(
    ("change", "facts"),
    [
        (lambda s: replace(s, frequency=-1.0), ("frequency", "-1.0")),
        (lambda s: replace(s, name="ya\x1brd"), ("name", r"'ya\x1brd'")),
        (gateway(position=(0.0, np.inf, 0.0)), ("gateway.position", "inf")),
        (gateway(position=(0.0, 1e6, 0.0)), ("gateway.position", "1000000.0")),
        (gateway(position=(0.5, 0.5, 0.2)), ("gateway.position", "[0.5, 0.5, 0.2]", '"crate"')),
        (gateway(orientation=(1.0, 1.0, 0.0, 0.0)), ("gateway.orientation", "1.414")),
        (gateway(orientation=(0.0, 0.0, 0.0, np.nan)), ("gateway.orientation", "nan")),
        (gateway(pattern="isso"), ("gateway.pattern", '"isso"', '"iso"')),
        (gateway(polarization="VH"), ("gateway.polarization", '"VH"')),
        (gateway(rows=0), ("gateway.rows", "0 x 4")),
        (gateway(rows=65), ("gateway.rows", "65 x 4")),
        (gateway(rows=64, columns=17), ("gateway", "1024", "64 x 17")),
        (gateway(spacing=0.0), ("gateway.spacing", "0.0")),
        (gateway(spacing=1e3), ("gateway.spacing", "1000.0")),
        (transmitter(orientation=(0.0, 0.0, 0.0, 2.0)), ("transmitter.orientation", "length 2")),
        (transmitter(region_max=(1.0, -1.5, 1.5)), ("transmitter.region", "y from -1 to -1.5")),
        (transmitter(region_min=(1.0, -1.0, 1.5), region_max=(1.0, -1.0, 1.5)), ("transmitter.region", "one twice")),
        (transmitter(region_min=(np.nan, -1.0, 0.5)), ("transmitter.region.min", "nan")),
        (lambda s: replace(s, frequency=2.4e9), ('material "concrete"', "2400 MHz", "at 915 MHz")),
        (lambda s: replace(s, objects=()), ("object",)),
        (lambda s: replace(s, objects=tuple(SceneObject(f"c{k}", MANY, "wood") for k in range(3))), ("3000000",)),
        (second_object(SceneObject("floor", BOX, "wood")), ('objects[1] ("floor")', "name")),
        (second_object(SceneObject("c", BOX, "wod")), ('objects[1] ("c")', '"wod"', '"wood"')),
        (second_object(SceneObject("", BOX, "wood")), ("objects[1].name", "''")),
        (second_object(SceneObject("c", FAR, "wood")), ('objects[1] ("c")', "1000000.0")),
        (second_object(SceneObject("c", Trimesh(), "wood")), ('objects[1] ("c")', "triangles", "none")),
        (second_object(SceneObject("c", NAN, "wood")), ('objects[1] ("c")', "not finite")),
        (second_object(SceneObject("c", BOX, "wood", -0.1)), ('objects[1] ("c")', "thickness", "-0.1")),
        (second_object(SceneObject("c", BOX, "wood", 1e9)), ('objects[1] ("c")', "thickness", "1000000000.0")),
    ],
)
def test_refuses(scene, change, facts):
    with pytest.raises(InputError) as caught:
        validate(change(scene), "outdoors.yaml")
    assert str(caught.value).startswith("outdoors.yaml: ") and all(fact in str(caught.value) for fact in facts)


def test_a_gateway_shows_either_its_elements_or_its_rows_columns_and_spacing():
    planar = Gateway((0, 0, 1), (0, 0, 0, 1), rows=2)
    assert repr(planar) == (
        "Gateway(position=(0.0, 0.0, 1.0), orientation=(0.0, 0.0, 0.0, 1.0), rows=2, columns=4, spacing=0.5, "
        "pattern='iso', polarization='V')"
    )  # which digests of scenes are made from
    given = Gateway((0, 0, 1), (0, 0, 0, 1), elements=[[0, 0, 0], [0.1, 0, 0]])
    assert repr(given) == (
        "Gateway(position=(0.0, 0.0, 1.0), orientation=(0.0, 0.0, 0.0, 1.0), pattern='iso', polarization='V', "
        "elements=((0.0, 0.0, 0.0), (0.1, 0.0, 0.0)))"
    )
