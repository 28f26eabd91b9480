"""NeRF² for received powers: what it learns, from what, and what depends on the seed alone."""

import numpy as np
import pytest
import torch

import bisplat
from learn.comparison.method_factories import chosen_methods
from learn.models.peers.nerf2 import RaySize
from learn.powers.fit_powers import POWER_METHODS
from learn.powers.known_powers import KnownPowers
from learn.powers.nerf_powers import NerfPowers

SMALL = RaySize(4, 2, 4, width=16, layers=4)
GATEWAYS = np.array([[0.0, 0, 2], [6.0, 4, 2]])
PLACES = np.random.default_rng(0).uniform(0, 5, (24, 3))


def fitted(powers: np.ndarray, steps: int, seed: int = 0) -> NerfPowers:
    made = NerfPowers(steps, SMALL)
    made.fit(KnownPowers(PLACES, powers, GATEWAYS, -100.0, 0.125, seed))
    return made


def test_it_learns_a_level_for_each_gateway_from_what_was_received():
    powers = np.broadcast_to([-45.0, -75.0], (24, 2)).copy()
    powers[::3, 0] = np.nan
    powers[0] = np.nan  # received nowhere
    before, after = (fitted(powers, steps).predict(PLACES).median for steps in (1, 40))
    assert min(before.min(), after.min()) >= -100
    assert np.abs(after - [-45, -75]).mean() < 0.7 * np.abs(before - [-45, -75]).mean()


def test_powers_that_were_never_received_are_predicted_near_the_floor():
    nothing = np.full((24, 2), np.nan)
    before, after = (fitted(nothing, steps).predict(PLACES).median for steps in (1, 20))
    assert -100 <= after.mean() < before.mean() - 10


def test_the_result_depends_on_the_seed_alone():
    powers = -50 - PLACES[:, :2]
    before = torch.random.get_rng_state()
    first, again, other = (fitted(powers, 2, seed).predict(PLACES).median for seed in (0, 0, 1))
    assert torch.equal(before, torch.random.get_rng_state())
    np.testing.assert_array_equal(first, again)
    assert np.abs(first - other).max() > 0.1


def test_its_training_ends_in_time():
    made = NerfPowers(size=SMALL)
    made.fit(KnownPowers(PLACES, -50 - PLACES[:, :2], GATEWAYS, -100.0, 0.125, minutes=0.005))
    assert 1 <= made.steps < 3000


@pytest.mark.skipif(torch.cuda.is_available(), reason="the published size is trained")
def test_it_is_compared_only_if_it_is_named_and_says_that_it_is_reduced(tmp_path, monkeypatch):
    monkeypatch.setattr("learn.powers.nerf_powers.MOST_STEPS", 1)
    powers = -50 - PLACES[:, :2]
    hall = bisplat.write_rssi(tmp_path / "hall", PLACES, powers, {"a": GATEWAYS[0], "b": GATEWAYS[1]}, "2.4 GHz")
    assert "nerf2" not in chosen_methods(None, POWER_METHODS)
    comparison = bisplat.compare_powers(hall, ["nerf2", "nearest"], split="random")
    assert [row["label"] for row in comparison] == ["nerf2 (reduced)", "nearest"]
