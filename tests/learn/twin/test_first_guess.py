"""Of many poses of the gateway, the one is found that is near the true one, from responses and behind pictures."""

import numpy as np
import pytest

from learn.twin import starting_values as first_guess_module
from learn.twin.starting_values import start_nearby
from scenes.scene.tolerances import Tolerances
from scenes.scene.unknowns import unknowns, vary
from simulate.rays.core.propagation import Propagation
from simulate.rays.tracer import Tracer
from tests.small_scene import CABINET, small_scene

PROPAGATION = Propagation(max_depth=1, rays=20_000, diffraction=False)
POSITIONS = np.random.default_rng(0).uniform((2.0, -0.5, 1.0), (3.0, 0.5, 1.6), (12, 3))


@pytest.mark.parametrize("flips", [False, True])
def test_the_guess_is_near_the_true_pose(flips):
    which = unknowns(small_scene(CABINET), Tolerances(position=0.06, rotation=4.0, objects=0.03, materials=0.2))
    off = np.zeros(len(which))
    off[:6] = [0.1, -0.12, 0.05, 0.08, -0.06, 0.1]  # up to two standard deviations
    true = vary(small_scene(CABINET), which, off)
    measured = Tracer(true, PROPAGATION).responses(POSITIONS) * np.exp(2j * np.arange(12))[:, None]
    if flips:
        measured[::2] = measured[::2, ::-1].conj()
    guess = start_nearby([Tracer(small_scene(CABINET), PROPAGATION)], which, POSITIONS, measured, flips, counted=160)
    assert np.linalg.norm(guess[:3] - off[:3]) < 0.5 * np.linalg.norm(off[:3])
    assert not guess[6:].any()


def test_a_gateway_in_the_right_place_stays():
    which = unknowns(small_scene(CABINET), Tolerances())
    tracer = Tracer(small_scene(CABINET), PROPAGATION)
    assert not start_nearby([tracer], which, POSITIONS, tracer.responses(POSITIONS), flips=False, counted=160).any()


def test_a_guess_is_a_valid_scene(monkeypatch):
    """The next best where the best is not, and the description where none is."""
    which = unknowns(small_scene(CABINET), Tolerances(position=0.1, rotation=0, objects=0, materials=0))
    true = vary(small_scene(CABINET), which, np.array([-0.1, 0.0, 0.0]))
    tracer, measured = Tracer(small_scene(CABINET), PROPAGATION), Tracer(true, PROPAGATION).responses(POSITIONS)
    best = start_nearby([tracer], which, POSITIONS, measured, flips=False, counted=160)
    there = vary(small_scene(CABINET), which, best).gateway.position
    monkeypatch.setattr(first_guess_module, "is_valid", lambda scene: scene.gateway.position != there)
    other = start_nearby([tracer], which, POSITIONS, measured, flips=False, counted=160)
    assert other.any() and (other != best).any()
    monkeypatch.setattr(first_guess_module, "is_valid", lambda scene: False)
    assert not start_nearby([tracer], which, POSITIONS, measured, flips=False, counted=160).any()
