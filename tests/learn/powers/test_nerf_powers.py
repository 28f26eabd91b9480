"""NeRF² for received powers: what it learns, from what, and what depends on the seed alone."""

from dataclasses import replace

import numpy as np
import torch

from learn.models.peers.nerf2 import RaySize
from learn.powers.nerf_powers import NerfPowers
from tests.learn.taught import taught_powers

SMALL = RaySize(4, 2, 4, width=16, layers=4)
GATEWAYS = np.array([[0.0, 0, 2], [6.0, 4, 2]])
PLACES = np.random.default_rng(0).uniform(0, 5, (24, 3))


def fitted(powers: np.ndarray, steps: int, seed: int = 0) -> NerfPowers:
    made = NerfPowers(steps, SMALL)
    made.fit(taught_powers(PLACES, powers, GATEWAYS, seed=seed))
    return made


def test_it_learns_a_level_for_each_gateway_from_what_was_received():
    powers = np.broadcast_to([-45.0, -75.0], (24, 2)).copy()
    powers[::3, 0] = np.nan
    powers[0] = np.nan  # received nowhere
    before, after = (fitted(powers, steps).predict(PLACES).value for steps in (1, 40))
    assert min(before.min(), after.min()) >= -100
    assert np.abs(after - [-45, -75]).mean() < 0.7 * np.abs(before - [-45, -75]).mean()


def test_powers_that_were_never_received_are_predicted_near_the_floor():
    nothing = np.full((24, 2), np.nan)
    before, after = (fitted(nothing, steps).predict(PLACES).value for steps in (1, 20))
    assert -100 <= after.mean() < before.mean() - 10


def test_the_result_depends_on_the_seed_alone():
    powers = -50 - PLACES[:, :2]
    before = torch.random.get_rng_state()
    first, again, other = (fitted(powers, 2, seed).predict(PLACES).value for seed in (0, 0, 1))
    assert torch.equal(before, torch.random.get_rng_state())
    np.testing.assert_array_equal(first, again)
    assert np.abs(first - other).max() > 0.1


def test_its_training_ends_in_time():
    made = NerfPowers(size=SMALL)
    made.fit(replace(taught_powers(PLACES, -50 - PLACES[:, :2], GATEWAYS), minutes=0.005))
    assert 1 <= made.steps < 3000


def test_a_comparison_states_its_steps():
    made = NerfPowers(size=SMALL)
    made.fit(replace(taught_powers(PLACES, -50 - PLACES[:, :2], GATEWAYS), minutes=None, steps=3))
    assert made.steps == 3
