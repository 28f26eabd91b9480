"""The method helmholtz for powers, and kriging: exact at known places, honest intervals, and little data."""

import numpy as np
import pytest

from learn.data.neighbours import inverse_distance
from learn.methods.interpolation import InverseDistance, Kriging, Mean
from learn.powers.helmholtz_powers import HelmholtzPowers, _Gateway
from learn.powers.power_covariance import PowerCovariance, squared_separations
from learn.quantities.known import Known
from learn.quantities.known_powers import decades
from tests.learn.taught import taught_powers

GATEWAYS = np.array([[-3.0, 0, 2], [4.0, 4, 2], [0.5, -5, 2], [6, 6, 1]])


def drawn(count: int, noise: float, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Positions in a cube of 1 m, and powers of a law and a field of known covariance, dBm."""
    generator = np.random.default_rng(seed)
    at = generator.uniform(0, 1, (count, 3))
    covariance = PowerCovariance(np.array([1 - noise, 0.0, noise]), np.full(3, 0.6), np.full(3, 0.1))
    whole, _ = covariance.with_gradient(squared_separations(at, at))
    field = np.linalg.cholesky(whole + 1e-9 * np.eye(count)) @ generator.normal(size=(count, len(GATEWAYS)))
    distances = np.linalg.norm(at[:, None] - GATEWAYS, axis=-1)
    return at, -40 + 2.5 * decades(distances) + 4 * field


def task(at: np.ndarray, powers: np.ndarray, floor: float = -100.0) -> Known:
    return taught_powers(at, powers, GATEWAYS, floor, 0.33)


@pytest.mark.parametrize("method", [Kriging, HelmholtzPowers])
def test_known_powers_without_noise_are_reproduced(method):
    at, _ = drawn(60, noise=0.0)
    smooth = -40 + 2.5 * decades(np.linalg.norm(at[:, None] - GATEWAYS, axis=-1)) + 3 * np.sin(3 * at[:, :1])
    made = method()
    made.fit(task(at, smooth))
    assert np.abs(made.predict(at).value - smooth).max() < 0.05


def test_stated_intervals_hold_nine_of_ten_powers_and_the_field_is_predicted():
    at, powers = drawn(500, noise=0.1)
    found = {}
    for method in (HelmholtzPowers, InverseDistance, Mean):
        made = method()
        made.fit(task(at[:250], powers[:250]))
        found[method] = made.predict(at[250:])
    field = found[HelmholtzPowers]
    within = (field.low <= powers[250:]) & (powers[250:] <= field.high)
    assert 0.85 <= within.mean() <= 0.95
    error = {method: np.median(np.abs(each.value - powers[250:])) for method, each in found.items()}
    assert error[HelmholtzPowers] < error[InverseDistance] < error[Mean]


def test_intervals_of_fading_hold_too_and_the_median_lies_above_the_mean():
    generator = np.random.default_rng(4)
    at, waves = generator.uniform(0, 1, (400, 3)), generator.normal(size=(40, 3))
    gains = generator.normal(size=(40, 4)) + 1j * generator.normal(size=(40, 4))
    response = np.exp(1j * at @ (19 * waves / np.linalg.norm(waves, axis=1, keepdims=True)).T) @ gains
    powers = -60 + 20 * np.log10(np.abs(response))
    made = HelmholtzPowers()
    made.fit(task(at[:200], powers[:200]))
    found = made.predict(at[200:])
    assert 0.85 <= ((found.low <= powers[200:]) & (powers[200:] <= found.high)).mean() <= 0.95
    assert (found.high - found.value).mean() < (found.value - found.low).mean()
    assert np.median(found.value - powers[200:]) == pytest.approx(0, abs=0.6)
    assert made.covariance.shares[1] > 0.3  # fading, not noise


def test_two_known_powers_still_have_an_interval():
    at, powers = drawn(8, noise=0.1)
    made = HelmholtzPowers()
    made.fit(task(at[:2], powers[:2]))
    found = made.predict(at[2:])
    assert (found.high - found.low > 5).all()


def test_leaving_out_by_formula_is_leaving_out():
    at, powers = drawn(12, noise=0.2)
    covariance = PowerCovariance(np.array([0.5, 0.3, 0.2]), np.full(3, 0.5), np.full(3, 0.2))
    whole, _ = covariance.with_gradient(squared_separations(at, at))
    decade, power = decades(np.linalg.norm(at - GATEWAYS[0], axis=1)), powers[:, 0]
    trend = np.stack([np.ones_like(decade), decade], axis=1)
    kept = np.arange(12) != 4
    without = _Gateway(np.linalg.inv(whole[np.ix_(kept, kept)]), trend[kept], power[kept])
    mean, _ = without.predict(whole[[4]][:, kept], np.zeros(1), trend[[4]])
    whole_field = _Gateway(np.linalg.inv(whole), trend, power)
    assert whole_field.left_out_error[4] == pytest.approx(power[4] - mean[0])


def test_left_out_neighbours_do_not_predict_themselves():
    at = np.array([[0.0, 0, 0], [1, 0, 0], [1, 0, 0], [5, 0, 0]])
    powers = np.array([[-10.0], [-20], [-30], [-40]])
    left_out = inverse_distance(at, powers, at, leave_out=True)[:, 0]
    assert left_out[1] == pytest.approx(-30, abs=1e-3) and left_out[2] == pytest.approx(-20, abs=1e-3)
    assert inverse_distance(at[:1], powers[:1], at, leave_out=False).ravel().tolist() == [-10] * 4
    between = inverse_distance(at[[0, 3]], powers[[0, 3]], np.array([[1.25, 0, 0]]))
    assert between.item() == pytest.approx(0.75 * -10 + 0.25 * -40)  # at distances of 1.25 and 3.75


@pytest.mark.parametrize("count", [1, 2, 5])
def test_a_few_powers_some_of_which_were_not_received(count):
    at, powers = drawn(20, noise=0.1)
    powers[::2, 1] = np.nan
    powers[:, 2] = np.nan
    for method in (Mean, InverseDistance, Kriging, HelmholtzPowers):
        made = method()
        made.fit(task(at[:count], powers[:count], floor=-70))
        found = made.predict(at[count:])
        assert found.value.shape == (20 - count, 4) and np.isfinite(found.value).all()
        assert (found.value[:, 2] < -70).all(), method
