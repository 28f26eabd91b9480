"""What ``sionna_paths`` and ``reflection_chains`` build on Sionna RT's internals, against its public solver."""

from dataclasses import replace

import numpy as np
import pytest

from scenes.files.errors import InputError
from scenes.scene.shapes import sheet
from simulate.rays.core import reflection_chains
from simulate.rays.core.propagation import Propagation
from simulate.rays.tracer import Tracer


@pytest.mark.parametrize("place", [1, 2, 4, 9])
def test_response_of_every_element_is_that_of_the_public_path_solver(
    place, room, room_positions, room_responses, public_solver
):
    expected = public_solver(room, room_positions[place], rays=100_000, depth=2, gateway_sends=True)
    assert np.abs(room_responses[place] - expected).max() < 1e-3 * np.abs(expected).max()


@pytest.mark.parametrize("drawn", ["of many triangles", "as two objects side by side"])
def test_wall_reflects_once(drawn, room, room_positions, room_responses, two_bounces):
    """Every triangle of every sheet cut into 64, or the floor in two objects that share a plane: one chain."""
    if drawn == "of many triangles":
        objects = [replace(item, mesh=item.mesh.subdivide().subdivide().subdivide()) for item in room.objects]
    else:
        left, right = (sheet((x, -20, 0), (width, 0, 0), (0, 40, 0)) for x, width in ((-20, 18), (-2, 22)))
        halves = replace(room.objects[0], mesh=left), replace(room.objects[0], name="right", mesh=right)
        objects = [*halves, *room.objects[1:]]
    found = Tracer(replace(room, objects=tuple(objects)), two_bounces).responses(room_positions)
    assert np.abs(found - room_responses).max() < 1e-3 * np.abs(room_responses).max()


@pytest.mark.parametrize("rays", [100_000, 100])
def test_finding_chains_again_gives_the_same_bits(rays, room, room_positions, two_bounces):
    """Also with so few rays that a search misses chains: it must miss the same ones."""
    first, second = (Tracer(room, replace(two_bounces, rays=rays)).responses(room_positions) for _ in range(2))
    assert (first == second).all()


def test_responses_do_not_depend_on_the_order_of_positions(room_tracer, room_positions, room_responses):
    order = np.random.default_rng(0).permutation(len(room_positions))
    assert (room_tracer.responses(room_positions[order]) == room_responses[order]).all()


def test_too_many_rays_to_shoot_are_refused_with_the_most_that_fit(room):
    with pytest.raises(InputError, match=r"^rays: expected at most 100,000 .* found 1,000,000$"):
        Tracer(room, Propagation(max_depth=5, diffuse=True, sionna=True, rays=1_000_000))


def test_path_that_only_outer_elements_have_is_found(room, public_solver, two_bounces):
    """From the array's centre every ray to the back wall and on to the screen's far side meets the screen first."""
    item = room.objects[3]
    screen = replace(item, mesh=sheet((-1.4, -1.2, 0.4), (0, 1.3, 0), (0, 0, 1.5)))
    scene, position = replace(room, objects=(*room.objects[:3], screen)), np.array([[-4.1426, -0.8921, 1.2667]])
    expected = public_solver(scene, position[0], rays=100_000, depth=2, gateway_sends=True)
    found = Tracer(scene, two_bounces).responses(position)[0]
    assert np.abs(found - expected).max() < 1e-3 * np.abs(expected).max()


def test_chains_left_out_carry_next_to_nothing(room, room_positions, room_responses, two_bounces, monkeypatch):
    """And with a threshold that matters, leaving out does matter."""
    monkeypatch.setattr(reflection_chains, "NEGLIGIBLE", 0.0)
    everything = Tracer(room, two_bounces).responses(room_positions)
    assert np.abs(everything - room_responses).max() < 1e-3 * np.abs(room_responses).max()
    monkeypatch.setattr(reflection_chains, "NEGLIGIBLE", 0.1)
    little = Tracer(room, two_bounces)
    assert len(little.found.reflected) < 4
    assert np.abs(little.responses(room_positions) - room_responses).max() > 1e-2 * np.abs(room_responses).max()


def test_paths_to_one_position_add_up_to_the_response_of_their_element(room_tracer, room_positions, room_responses):
    for position, responses in zip(room_positions[:4], room_responses, strict=False):
        paths = room_tracer.paths(position)
        gains = [abs(path.response) for path in paths]
        assert gains == sorted(gains, reverse=True) and len(paths) > 3
        np.testing.assert_allclose(sum(path.response for path in paths), responses[5], rtol=1e-4)


def test_paths_shot_in_sionnas_way_add_up_too(room, room_positions):
    """Its rays find other edges for one element alone than for all of them."""
    tracer = Tracer(room, Propagation(max_depth=2, sionna=True, rays=2000))
    for position in room_positions[:2]:
        expected = tracer.responses(position[None])[0, 5]
        np.testing.assert_allclose(sum(path.response for path in tracer.paths(position)), expected, rtol=1e-4)


def test_course_of_a_reflection_is_that_of_the_mirrored_source(make_scene, floor):
    scene = make_scene(floor)
    paths = Tracer(scene, Propagation(max_depth=1, diffraction=False, rays=10_000)).paths(np.array([-4.0, 0.5, 1.0]))
    assert [len(path.vertices) for path in paths] == [2, 3]
    direct, reflected = (path.vertices for path in paths)
    quarter = scene.wavelength / 4  # of the elements nearest the centre, the first; the gateway's x axis is world −y
    np.testing.assert_allclose(direct, [[0, quarter, 1.5 - quarter], [-4, 0.5, 1]], atol=1e-5)
    share = direct[0][2] / (direct[0][2] + 1.0)
    expected = [direct[0], (1 - share) * direct[0] + share * np.array([-4, 0.5, 1.0]), [-4, 0.5, 1.0]]
    expected[1] = [*expected[1][:2], 0.0]
    np.testing.assert_allclose(reflected, expected, atol=1e-3)
