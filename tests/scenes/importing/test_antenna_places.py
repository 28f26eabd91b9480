"""A gateway or a region in an odd place is warned of, in the numbers of the scene; usual places are not."""

from dataclasses import replace

import pytest

from scenes.importing.import_doubts import antenna_warnings
from scenes.places.closet import closet
from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.description import Scene, SceneObject
from scenes.scene.materials import p2040_materials
from scenes.scene.orientation import facing
from scenes.scene.shapes import box, sheet
from scenes.storage.scene_yaml import BUILT_IN

WEST, EAST = facing((-1, 0, 0)), facing((1, 0, 0))


def scene(gateway, region, *meshes):
    objects = tuple(SceneObject(f"object {k}", mesh, "concrete") for k, mesh in enumerate(meshes))
    return Scene("s", 915e6, gateway, region, objects, p2040_materials(["concrete"], 915e6))


ROOM = box((0, 0, 0), (5, 4, 3))
GATEWAY, REGION = Gateway((4.7, 2, 1.8), WEST), Transmitter((1, 1, 0.8), (2.5, 3, 1.7))
ODD = {
    "the gateway is beside": (Gateway((5.5, 2, 1.8), WEST), REGION, "found the gateway outside it"),
    "the region is beside": (GATEWAY, Transmitter((-3, 1, 0.8), (-1, 3, 1.7)), "found the transmitter region outside"),
    "a part of the region is outside": (
        GATEWAY,
        Transmitter((-1, 1, 0.8), (2, 3, 1.7)),
        "reaches from (-1, 1, 0.8) to",
    ),
    "the gateway is above the ceiling": (Gateway((4.7, 2, 3.8), WEST), REGION, "z = 3 m, found the gateway above it"),
    "the region is above": (GATEWAY, Transmitter((1, 1, 3.5), (2, 3, 4)), "found the transmitter region above it"),
    "both are above": (
        Gateway((4.7, 2, 4), WEST),
        Transmitter((1, 1, 3.5), (2, 3, 4)),
        "found the gateway and the transmitter region above it",
    ),
    "the gateway is below": (Gateway((4.7, 2, -0.5), WEST), REGION, "z = 0 m, found the gateway below it"),
    "the gateway looks away": (Gateway((4.7, 2, 1.8), EAST), REGION, "found the whole region behind it; the boresight"),
}


@pytest.mark.parametrize("case", ODD)
def test_odd_places(case):
    gateway, region, words = ODD[case]
    (warning,) = antenna_warnings(scene(gateway, region, ROOM))
    assert words in warning


GROUND = sheet((-20, -20, 0), (40, 0, 0), (0, 40, 0))
HOUSE = box((5, -5, 0), (12, 5, 10))
USUAL = {
    "in the room": (GATEWAY, REGION, [ROOM]),
    "a yard without a roof": (Gateway((4, 2, 3), WEST), REGION, [GROUND]),
    "a mast higher than the houses": (Gateway((4, 2, 30), WEST), REGION, [GROUND, HOUSE]),
    "on the floor": (GATEWAY, Transmitter((1, 1, 0), (2, 3, 3)), [ROOM]),
    "looking down": (Gateway((4, 2, 2.9), facing((0, 0, -1))), REGION, [ROOM]),
}


@pytest.mark.parametrize("case", USUAL)
def test_usual_places(case):
    gateway, region, meshes = USUAL[case]
    assert antenna_warnings(scene(gateway, region, *meshes)) == []


@pytest.mark.parametrize("name", BUILT_IN)
def test_built_in_places(name):
    assert antenna_warnings(BUILT_IN[name]()) == []


def test_numbers_are_plain():
    place = closet()
    far = replace(place, gateway=replace(place.gateway, position=(41_234.5, 1e-17, 1.0)))
    (warning,) = antenna_warnings(far)
    assert "e+" not in warning and "e-" not in warning
