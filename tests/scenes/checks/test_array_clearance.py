"""An array hangs in the open: in front of a wall, not on it and not through it."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from scenes.checks.occupancy import element_positions, obstruction
from scenes.checks.validation import validate
from scenes.files.errors import InputError
from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.description import SceneObject
from scenes.scene.materials import p2040_materials
from scenes.scene.orientation import facing
from scenes.scene.shapes import box, sheet
from simulate.spectra.array import PlanarArray

WAVELENGTH = 0.32
WALL = SceneObject("wall", sheet((0, -3, 0), (0, 6, 0), (0, 0, 3)), "brick")  # the plane x = 0


def where(gateway, *objects):
    found = obstruction(gateway, WAVELENGTH, objects or (WALL,))
    return found and found.where


def test_elements_are_numbered_as_the_array_numbers_them():
    gateway = Gateway((1.0, 2.0, 3.0), facing((0.3, -1.0, 0.2)), rows=3, columns=5, spacing=0.4)
    turned = Rotation.from_quat(gateway.orientation).apply(PlanarArray.of(gateway).positions)
    np.testing.assert_allclose(element_positions(gateway, 0.1), gateway.position + 0.1 * turned, atol=1e-12)


@pytest.mark.parametrize(
    ("distance", "boresight", "expected"),
    [
        (0.0, (1, 0, 0), "on"),
        (0.0005, (1, 0, 0), "on"),
        (0.01, (1, 0, 0), None),  # flat on a wall, like a picture
        (0.01, (-1, 0, 0), None),
        (0.01, (1, 0.1, 0), "behind"),  # turned away from it, so that one edge is in it
        (0.2, (0, 1, 0), "behind"),
        (0.25, (0, 1, 0), None),  # half its width and a centimetre
        (0.24, (0, 1, 0), "on"),
    ],
)
def test_array_at_a_wall(distance, boresight, expected):
    assert where(Gateway((distance, 0, 1.5), facing(boresight))) == expected


def test_wall_that_ends_before_the_array_is_not_in_its_way():
    gateway = Gateway((0, 3.3, 1.5), facing((0, 1, 0)))
    assert where(gateway) is None
    assert where(replace(gateway, position=(0.01, 2.9, 1.5))) == "behind"


def test_something_thin_between_two_elements_is_found():
    pole = SceneObject("pole", box((-0.01, -0.1, 0), (0.01, -0.07, 3)), "metal")
    assert where(Gateway((0, 0, 1.5), facing((1, 0, 0))), pole) == "behind"


def test_one_element_only_needs_its_own_place():
    alone = Gateway((0.01, 0, 1.5), facing((0, 1, 0)), rows=1, columns=1)
    assert where(alone) is None and where(replace(alone, position=(0, 0, 1.5))) == "on"


def test_a_higher_frequency_has_a_smaller_array(scene):
    near = replace(scene, gateway=replace(scene.gateway, position=(4.0, -1.5e-16, 0.1)))
    sentence = (
        r"outdoors: gateway.position \[4.0, 0.0, 0.1\]: expected all elements of the array in the open, found "
        r'one at .*, behind object "floor" \(at 915 MHz, elements are up to 0.348 m from the position\)'
    )
    with pytest.raises(InputError, match=sentence):
        validate(near, "outdoors")
    validate(replace(near, frequency=9e9, materials=p2040_materials(near.materials, 9e9)), "outdoors")


def test_elements_in_millimetres_are_told(scene):
    with pytest.raises(InputError, match=r"elements are up to 80.0 m from the position; are they in metres\?\)"):
        validate(scene.with_elements([[0, 0, 0], [0, -80, 0]]), "outdoors")


def test_further_gateway_is_named(scene):
    both = replace(scene, further_gateways={"low": replace(scene.gateway, position=(4.0, 0.0, 0.1))})
    with pytest.raises(InputError, match=r"outdoors: further_gateways.low.position .* object \"floor\""):
        validate(both, "outdoors")


def test_region_in_a_closed_room_that_the_gateway_is_not_in(scene):
    room = replace(scene, objects=(SceneObject("room", box((-5, -5, -0.1), (3, 5, 3)), "concrete"),))
    with pytest.raises(InputError, match=r'transmitter.region: .* found it inside "room" .* the gateway, which is at'):
        validate(room, "outdoors")
    validate(replace(room, gateway=replace(scene.gateway, position=(2.0, 0.0, 1.0))), "outdoors")
    corner = Transmitter(region_min=(2.0, 4.0, 0.5), region_max=(4.0, 6.0, 1.5))  # half of it is outside
    validate(replace(room, transmitter=corner), "outdoors")
