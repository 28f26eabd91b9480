"""Random rooms are the same for a seed, differ between seeds, and are valid places with everything inside."""

import collections

import numpy as np
import pytest

from scenes.checks.occupancy import blocking_object
from scenes.drawing.floor_plan import section
from scenes.files.errors import ParameterError
from scenes.places.furniture import KINDS
from scenes.places.random_room import CLEARANCE, GAP, RASTER, random_room
from scenes.scene.shapes import bounding_box

WALLS = 6  # Floor, ceiling and walls come first


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


@pytest.mark.parametrize("large", [False, True])
@pytest.mark.parametrize("seed", range(6))
def test_l_shaped_rooms_are_closed_and_everything_is_inside(seed, large):
    room = random_room(seed, (1, 12), shape="l", large=large)
    outline = room.objects[0].mesh.vertices
    inner, size = outline[3, :2], outline.max(axis=0)[:2]
    assert (inner < 0.8 * size).all() and (inner > 0.5 * size).all()
    inside = [item.mesh.bounds for item in room.objects[WALLS:] if item.name not in ("door", "window")]
    for low, high in [*inside, room.transmitter.region, [room.gateway.position] * 2]:
        assert (np.asarray(low)[:2] >= 0).all()
        assert (np.asarray(high)[:2] <= size).all() and (np.asarray(high)[:2] <= inner).any()
    above = room.bounds[1, 2] - 0.1  # the openings
    lines = np.concatenate([section(item.mesh, above) for item in room.objects[2:WALLS]])
    assert np.linalg.norm(lines[:, 0] - lines[:, 1], axis=1).sum() == pytest.approx(2 * size.sum())
    ends = collections.Counter(map(tuple, lines.reshape(-1, 2).round(6).tolist()))
    assert set(ends.values()) == {2}


def test_moved_furniture_leaves_the_room_as_it_is():
    first, second = (random_room(3, furniture=number) for number in (1, 2))
    assert first.gateway == second.gateway and first.transmitter == second.transmitter
    for one, other in zip(first.objects[:WALLS], second.objects[:WALLS], strict=True):
        np.testing.assert_array_equal(one.mesh.vertices, other.mesh.vertices)
    names = [{item.name for item in room.objects} - {"door", "window"} for room in (first, second)]
    assert names[0] != names[1]
    assert (random_room(3, large=True).bounds[1] > random_room(3).bounds[1]).all()


def test_rooms_of_a_seed_stay_what_they_are():
    """The number of tries for a piece decides which fit."""
    found = {shape: random_room(3, shape=shape) for shape in ("rectangle", "l")}
    assert found["rectangle"].gateway.position == (1.0, 0.36, 2.2) and found["l"].gateway.position == (2.41, 0.99, 1.85)
    assert [item.name for item in found["rectangle"].objects[WALLS:]] == ["door", "mirror", "fridge", "boiler"]


@pytest.mark.parametrize(("seed", "large"), [(8408, False), (2359, True)])
def test_rooms_whose_first_outline_has_no_place_for_the_region_are_drawn_again(seed, large):
    room = random_room(seed, shape="l", large=large)
    assert room.gateway == random_room(seed, shape="l", large=large).gateway
    low, high = room.transmitter.region
    assert (high > low).all()
