"""The log-distance law: exact without deviations, and unbiased where weak powers were not received."""

import numpy as np
import pytest

from learn.powers.log_distance import LogDistance, Mri
from learn.quantities.known_powers import KnownPowers, PathLoss, decades
from tests.learn.taught import taught_powers

GATEWAYS = np.array([[0.0, 0, 2], [9.0, 0, 2]])


def places(count: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform((0, 0, 0), (9, 6, 2), (count, 3))


def known(positions: np.ndarray, powers: np.ndarray, floor: float = -100.0) -> KnownPowers:
    return KnownPowers(positions, powers, GATEWAYS[: powers.shape[1]], floor, 0.125)


def test_a_law_is_recovered_exactly_and_extrapolated():
    near, far = places(20), places(5, seed=1) + np.array([20, 0, 0])
    law = lambda at: np.array([-40, -45]) + [2.5, 3.1] * decades(known(at, np.zeros((1, 2))).distances(at))  # noqa: E731
    task = known(near, law(near))
    assert task.law.level == pytest.approx([-40, -45]) and task.law.exponent == pytest.approx([2.5, 3.1])
    method = LogDistance()
    method.fit(taught_powers(near, law(near), GATEWAYS))
    assert method.predict(far).value == pytest.approx(law(far))


def test_the_law_of_all_gateways_together_is_that_of_each_if_they_agree():
    at = places(20)
    distances = known(at, np.zeros((1, 2))).distances(at)
    task = known(at, -40 + 2.2 * decades(distances))
    method = Mri()
    method.fit(taught_powers(at, task.powers, GATEWAYS))
    assert method.predict(at).value == pytest.approx(task.powers)


def test_powers_that_were_not_received_do_not_flatten_the_law():
    generator, at = np.random.default_rng(3), places(4000)
    distances = known(at, np.zeros((1, 1))).distances(at)
    powers = -40 + 3.0 * decades(distances) + generator.normal(0, 4, distances.shape)
    powers[powers < -65] = np.nan
    assert 0.2 < np.isnan(powers).mean() < 0.6
    law = PathLoss.fit(distances, powers, floor=-65)
    heard = ~np.isnan(powers[:, 0])
    naive = -np.polyfit(10 * np.log10(distances[heard, 0]), powers[heard, 0], 1)[0]
    assert law.exponent[0] == pytest.approx(3, abs=0.15) and law.deviation[0] == pytest.approx(4, abs=0.2)
    assert naive < 2.6


def test_a_power_that_was_not_received_is_filled_below_the_floor():
    at = places(30)
    powers = -40 + 2 * decades(known(at, np.zeros((1, 1))).distances(at))
    powers[:4] = np.nan
    filled = known(at, powers, floor=-55.0).filled
    assert (filled[:4] < -55).all() and (filled[4:] == powers[4:]).all()


def test_gateways_that_tell_no_law():
    silent = PathLoss.fit(np.ones((3, 1)), np.full((3, 1), np.nan), floor=-90)
    assert silent(np.array([[5.0]]))[0, 0] == -91
    one_distance = PathLoss.fit(np.full((3, 1), 10.0), np.full((3, 1), -60.0), floor=-90)
    assert one_distance(np.array([[10.0], [100.0]])).ravel() == pytest.approx([-60, -80])
    at_the_gateway = PathLoss.fit(np.zeros((2, 1)), np.full((2, 1), -20.0), floor=-90)
    assert np.isfinite(at_the_gateway(np.array([[0.0]]))).all()
