"""Starting values of a calibration: near the true pose from nearby and from far away, by responses and pictures."""

import numpy as np
import pytest

from learn.twin import starting_values
from learn.twin.linearised import over_band
from learn.twin.starting_values import elements_of, inside, is_far, responses_of
from scenes.places.built_in import closet
from scenes.scene.tolerances import Tolerances
from scenes.scene.unknowns import unknowns, vary
from simulate.rays.core.propagation import Propagation
from simulate.rays.tracer import Tracer
from tests.learn.twin.small_search import search_by
from tests.small_scene import CABINET, small_scene

PROPAGATION = Propagation(max_depth=1, rays=20_000, diffraction=False)
POSITIONS = np.random.default_rng(0).uniform((2.0, -0.5, 1.0), (3.0, 0.5, 1.6), (12, 3))


@pytest.mark.parametrize("flips", [False, True])
def test_the_nearby_start_is_near_the_true_pose(flips):
    which = unknowns(small_scene(CABINET), Tolerances(position=0.06, rotation=4.0, objects=0.03, materials=0.2))
    off = np.zeros(len(which))
    off[:6] = [0.1, -0.12, 0.05, 0.08, -0.06, 0.1]  # up to two standard deviations
    true = vary(small_scene(CABINET), which, off)
    measured = Tracer(true, PROPAGATION).responses(POSITIONS) * np.exp(2j * np.arange(12))[:, None]
    if flips:
        measured[::2] = measured[::2, ::-1].conj()
    guess = search_by(small_scene(CABINET), which, PROPAGATION, POSITIONS, measured, not flips).drawn()
    assert np.linalg.norm(guess[:3] - off[:3]) < 0.5 * np.linalg.norm(off[:3])
    assert not guess[6:].any()


def test_a_guess_is_a_valid_scene(monkeypatch):
    """The next best where the best is not, and the description where none is."""
    which = unknowns(small_scene(CABINET), Tolerances(position=0.1, rotation=0, objects=0, materials=0))
    true = vary(small_scene(CABINET), which, np.array([-0.1, 0.0, 0.0]))
    measured = Tracer(true, PROPAGATION).responses(POSITIONS)
    search = search_by(small_scene(CABINET), which, PROPAGATION, POSITIONS, measured, True)
    best = search.drawn()
    there = vary(small_scene(CABINET), which, best).gateway.position
    monkeypatch.setattr(starting_values, "is_valid", lambda scene: scene.gateway.position != there)
    other = search.drawn()
    assert other.any() and (other != best).any()
    monkeypatch.setattr(starting_values, "is_valid", lambda scene: False)
    assert not search.drawn().any()


OFF = np.array([-0.4, 0.5, -0.3, 0.04, -0.03, 0.05])
FAR = Tolerances(position=0.4, rotation=2.0, objects=0, materials=0)


@pytest.fixture(scope="module")
def far():
    """The small scene as described, 70 cm off, what may be wrong, and the responses over a band in the true one."""
    true, ratios = small_scene(CABINET), (0.99, 1.01)
    measured = [each.responses(POSITIONS).astype(complex) for each in over_band(Tracer(true, PROPAGATION), ratios)]
    which = unknowns(true, FAR)
    return vary(true, which, -OFF), which, ratios, np.concatenate(measured, axis=1)


def test_responses_far_away_are_those_of_paths_to_the_same_images():
    """They match what is traced there, up to amplitudes; lengths to first order do not."""
    scene, which = small_scene(), unknowns(small_scene(), FAR)
    expected = Tracer(vary(scene, which, OFF), PROPAGATION).responses(POSITIONS)
    tracer = Tracer(scene, PROPAGATION)
    there = elements_of(scene, which, OFF[None])
    found, nearby = (np.concatenate(list(responses_of([tracer], POSITIONS, there, near))) for near in (False, True))

    def alike(responses):
        return abs(np.vdot(responses, expected)) / np.linalg.norm(responses) / np.linalg.norm(expected)

    assert alike(found) > 0.998 and alike(nearby) < 0.97


@pytest.mark.slow
def test_the_start_from_far_away_is_near_the_true_pose(far, monkeypatch):
    monkeypatch.setattr(starting_values, "KEPT", 3)
    described, which, ratios, measured = far
    turned = measured * np.exp(2j * np.arange(12))[:, None]
    guess = search_by(described, which, PROPAGATION, POSITIONS, turned, True, ratios).drawn()
    assert np.linalg.norm(guess[:3] - OFF[:3]) < 0.08


@pytest.mark.slow
def test_the_pose_is_found_in_a_room_from_far_away():
    """From a metre away, where steps from the description, and from a guess near it, end elsewhere."""
    true, which = closet(), unknowns(closet(), Tolerances(position=0.6, rotation=2.0, objects=0, materials=0))
    off = np.array([-0.5, 0.7, 0.4, 0.04, -0.03, 0.05])
    places = np.random.default_rng(1).uniform(*true.transmitter.region, (8, 3))
    measured = Tracer(true, PROPAGATION).responses(places).astype(complex)
    found = search_by(vary(true, which, -off), which, PROPAGATION, places, measured, True).most_likely()
    assert np.linalg.norm(found.values[:3] - off[:3]) < 0.01


def test_where_no_path_reaches_the_guess_is_the_description(monkeypatch):
    monkeypatch.setattr(starting_values, "DRAWN", 3)
    scene, which = small_scene(CABINET), unknowns(small_scene(CABINET), FAR)
    behind = np.array([[2.0, 2.5, 1.2]])
    followed = Propagation(max_depth=0, rays=1000, diffraction=False)
    assert not search_by(scene, which, followed, behind, np.ones((1, 16), complex), True).drawn().any()


def test_only_guesses_inside_are_drawn_for_a_gateway_inside():
    scene, which = small_scene(CABINET), unknowns(small_scene(CABINET), FAR)
    guesses = np.zeros((3, 6))
    guesses[1, 2], guesses[2, 2] = -2.0, 1.0  # below the floor, and below the cabinet's top
    assert inside(scene, which, guesses).tolist() == [True, False, True]
    above = vary(scene, which, np.array([0, 0, 3.0, 0, 0, 0]))
    assert inside(above, which, guesses).all()


def test_a_pose_is_far_if_it_may_be_half_a_wavelength_off():
    scene = small_scene()
    far, near = (unknowns(scene, Tolerances(position=share * scene.wavelength, objects=0)) for share in (0.51, 0.49))
    assert is_far(scene, far) and not is_far(scene, near)
    assert not is_far(scene, unknowns(scene, Tolerances(position=0, objects=1.0)))  # objects may, the gateway may not
