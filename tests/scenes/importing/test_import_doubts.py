"""A unit by which a place has another size than what happens in it is refused or doubted, and the right one named."""

import numpy as np
import pytest

from scenes.files.errors import InputError
from scenes.files.lengths import METRES
from scenes.importing.mesh_import import import_scene
from scenes.importing.plausibility import antenna_warnings, unit_doubt
from scenes.places.built_in import BUILT_IN
from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.description import Scene, SceneObject
from scenes.scene.materials import p2040_materials
from scenes.scene.orientation import facing
from scenes.scene.shapes import box, sheet

ROOM = np.array([[0.0, 0.0, 0.0], [5.0, 4.0, 3.0]])
ANTENNAS = np.array([[4.7, 2.0, 1.8], [1.0, 1.0, 0.8], [2.5, 3.0, 1.7]])
GATEWAY = Gateway((4.7, 2.0, 1.8), facing((-1, 0, 0)))
REGION = Transmitter((1.0, 1.0, 0.8), (2.5, 3.0, 1.7))


def doubt(true, read):
    return unit_doubt(ROOM * METRES[read] / METRES[true], ANTENNAS, read, 0.33)


@pytest.mark.parametrize("unit", METRES)
def test_right_unit_is_not_doubted(unit):
    assert doubt(unit, unit) is None


IMPOSSIBLE = [("mm", "m"), ("mm", "ft"), ("m", "mm"), ("m", "cm"), ("ft", "mm")]


@pytest.mark.parametrize(("true", "read"), [*IMPOSSIBLE, ("cm", "m"), ("cm", "mm")])
def test_wrong_unit_is_impossible_or_doubted_and_the_right_one_is_named(true, read):
    found = doubt(true, read)
    assert found.decisive == ((true, read) in IMPOSSIBLE)
    assert f"with the unit {true} it would be 5 x 4 x 3 m" in found.sentence


def test_place_smaller_than_the_wavelength_is_impossible():
    close = np.array([[0.05, 0.0, 0.0], [0.01, 0.02, 0.0]])
    found = unit_doubt(ROOM / 50, close, "m", 0.33)
    assert found.decisive and "wavelength, 0.33 m" in found.sentence
    assert unit_doubt(ROOM / 50, close, "m", 0.01) is None


@pytest.mark.parametrize("name", BUILT_IN)
def test_built_in_places_are_not_doubted(name):
    place = BUILT_IN[name]()
    antennas = np.vstack([place.gateway.position, place.transmitter.corners()])
    assert unit_doubt(place.bounds, antennas, "m", place.wavelength) is None
    assert antenna_warnings(place) == []


@pytest.mark.filterwarnings("error")
def test_street_of_a_kilometre_and_antennas_out_of_reach_are_not_doubted():
    street = np.array([[-427.0, -338.0, 0.0], [427.0, 338.0, 50.0]])  # Sionna RT's etoile
    assert unit_doubt(street, np.array([[0, -150, 30], [-50, -50, 1], [-20, -20, 2]]), "m", 0.086) is None
    assert unit_doubt(street, np.array([[0, 0, 10], [-15, -15, 1], [15, 15, 2]]), "m", 0.086) is None
    assert unit_doubt(ROOM, ANTENNAS * 1e300, "m", 0.33) is None  # left to other checks


def test_import_refuses_the_unit_before_it_looks_at_the_gateway(tmp_path):
    box((0, 0, 0), (5000, 4000, 3000)).export(tmp_path / "room.stl")
    with pytest.raises(InputError, match=r"room.stl: .* with the unit mm it would be 5 x"):
        import_scene(tmp_path / "room.stl", [("*", "brick")], gateway=GATEWAY, transmitter=REGION)
    _, report = import_scene(tmp_path / "room.stl", [("*", "brick")], unit="mm", gateway=GATEWAY, transmitter=REGION)
    assert report.warnings == ()


WEST, EAST = facing((-1, 0, 0)), facing((1, 0, 0))


def scene(gateway, region, *meshes):
    objects = tuple(SceneObject(f"object {k}", mesh, "concrete") for k, mesh in enumerate(meshes))
    return Scene("s", 915e6, gateway, region, objects, p2040_materials(["concrete"], 915e6))


WALLS = box((0, 0, 0), (5, 4, 3))
ABOVE = Transmitter((1, 1, 3.5), (2, 3, 4))
ODD = {
    "the gateway outside": (Gateway((5.5, 2, 1.8), WEST), REGION),
    "the transmitter region outside": (GATEWAY, Transmitter((-3, 1, 0.8), (-1, 3, 1.7))),
    "reaches from (-1, 1, 0.8) to": (GATEWAY, Transmitter((-1, 1, 0.8), (2, 3, 1.7))),  # a part of it is outside
    "the gateway above": (Gateway((4.7, 2, 3.8), WEST), REGION),
    "the gateway and the transmitter region above": (Gateway((4.7, 2, 4), WEST), ABOVE),
    "the gateway below": (Gateway((4.7, 2, -0.5), WEST), REGION),
    "the whole region behind": (Gateway((4.7, 2, 1.8), EAST), REGION),
}


@pytest.mark.parametrize("words", ODD)
def test_odd_places(words):
    (warning,) = antenna_warnings(scene(*ODD[words], WALLS))
    assert words in warning


GROUND = sheet((-20, -20, 0), (40, 0, 0), (0, 40, 0))
HOUSE = box((5, -5, 0), (12, 5, 10))
USUAL = {
    "in the room": (GATEWAY, REGION, [WALLS]),
    "a yard without a roof": (Gateway((4, 2, 3), WEST), REGION, [GROUND]),
    "a mast higher than the houses": (Gateway((4, 2, 30), WEST), REGION, [GROUND, HOUSE]),
    "on the floor": (GATEWAY, Transmitter((1, 1, 0), (2, 3, 3)), [WALLS]),
    "looking down": (Gateway((4, 2, 2.9), facing((0, 0, -1))), REGION, [WALLS]),
}


@pytest.mark.parametrize("case", USUAL)
def test_usual_places(case):
    gateway, region, meshes = USUAL[case]
    assert antenna_warnings(scene(gateway, region, *meshes)) == []
