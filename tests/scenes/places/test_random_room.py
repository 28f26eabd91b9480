"""Random rooms are the same for a seed, differ between seeds, and are valid places with everything inside."""

import numpy as np
import pytest

from scenes.checks.occupancy import blocking_object
from scenes.files.errors import ParameterError
from scenes.places.furniture import KINDS
from scenes.places.random_room import CLEARANCE, GAP, RASTER, random_room
from scenes.scene.shapes import bounding_box

WALLS = 6
"""Floor, ceiling and walls come first."""


@pytest.mark.parametrize("seed", range(20))
def test_everything_is_inside_and_the_region_is_free(seed):
    room = random_room(seed)
    names = [item.name for item in room.objects]
    size = room.objects[1].mesh.bounds[1]  # of the ceiling
    low, high = np.array(room.transmitter.region)
    furniture = [item for item in room.objects[WALLS:] if item.name not in ("door", "window")]
    assert len(set(names)) == len(names)
    for item in furniture:
        bounds = bounding_box(item.mesh.vertices)
        assert (bounds[0] > 0).all() and (bounds[1] < size).all()
        assert (bounds[0] > high + CLEARANCE - 1e-9).any() or (bounds[1] < low - CLEARANCE + 1e-9).any()
    corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
    assert blocking_object(room, corners) == [None] * 8


def test_rooms_are_repeated_by_their_seed_and_differ_between_seeds():
    rooms = [random_room(seed) for seed in (3, 3, 4)]
    for first, second in zip(rooms[0].objects, rooms[1].objects, strict=True):
        np.testing.assert_array_equal(first.mesh.vertices, second.mesh.vertices)
    assert rooms[0].gateway == rooms[1].gateway != rooms[2].gateway


def test_all_kinds_occur_and_gateways_look_obliquely():
    rooms = [random_room(seed) for seed in range(60)]
    assert {kind.name for kind in KINDS} <= {item.name for room in rooms for item in room.objects}
    up = [abs(room.gateway.boresight[2]) for room in rooms]
    assert np.median(up) > 0.15 and max(up) < np.sin(np.radians(36))


def test_flat_metal_lies_on_cells_of_full_wave():
    kinds = {kind.name for kind in KINDS if kind.flat_metal}
    for room in map(random_room, range(20)):
        size = room.objects[1].mesh.bounds[1]
        for item in room.objects:
            if item.name in kinds:
                steps = item.mesh.vertices / RASTER
                at_wall = np.isclose(item.mesh.vertices, GAP) | np.isclose(item.mesh.vertices, size - GAP)
                assert (np.isclose(steps, np.round(steps)) | at_wall).all()


def test_furniture_can_be_left_out():
    names = [item.name for item in random_room(5, pieces=(0, 0)).objects[WALLS:]]
    assert set(names) <= {"door", "window"}


def test_a_seed_that_is_none_is_refused():
    with pytest.raises(ParameterError, match="seed"):
        random_room(-1)
