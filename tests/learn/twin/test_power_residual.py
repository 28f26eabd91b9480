"""Received powers beside traced ones: the level and the share of fading are found, and bounds count as bounds."""

import numpy as np
import pytest

from learn.twin.power_residual import DB, NOISES, PowerResidual

GENERATOR = np.random.default_rng(0)
TRACED = (GENERATOR.normal(size=(400, 2, 2)) @ [1, 1j]) * [1e-3, 1e-4]
SCALES = np.full((400, 2), 2.0) * [1e-6, 1e-8]


def rice(share):
    """Powers, dBm, of traced responses and random ones, with levels of 10 and 30 dBm."""
    random = np.random.default_rng(1).normal(size=(400, 2, 2)) @ [1, 1j]
    return 20 * np.log10(np.abs(TRACED + random * np.sqrt(share * SCALES / 2))) + [10, 30]


def likelihood(powers, floor=-200.0):
    return PowerResidual(powers, floor, SCALES, np.ones(400))


@pytest.mark.parametrize("share", [0.01, 0.1, 1.0])
def test_levels_and_share_of_fading_are_found(share):
    judged, gains = likelihood(rice(share)), np.abs(TRACED) ** 2
    found = judged.best(gains)
    np.testing.assert_allclose(found.levels, [10, 30], atol=1)
    alike = [judged.given(gains, each, NOISES[0]).unlikely.sum() for each in (share / 30, share, share * 30)]
    assert alike[1] == min(alike)
    wrong = judged.best(np.roll(gains, 1, axis=0))
    assert wrong.unlikely.sum() > found.unlikely.sum() + 100


def test_slope_of_a_search_is_that_of_the_posterior():
    """By finite differences, where the responses are linear in the unknowns; some powers are bounds."""
    generator = np.random.default_rng(6)
    jacobian, traced = (generator.normal(size=(12, 2, n, 2)) @ [1, 1j] for n in (3, 1))
    scales = np.abs(traced[..., 0]) ** 2
    powers = DB * np.log(scales) + generator.normal(0, 3, (12, 2)) - 60
    powers[::3] = np.nan
    likelihood = PowerResidual(powers, -60.0, scales, np.ones(12))

    def fit(step):
        return likelihood.given(np.abs(traced[..., 0] + jacobian @ step) ** 2, 1e-5, 4.0)

    _, towards = likelihood.quadratic(fit(np.zeros(3)), traced[..., 0], jacobian)
    for number, small in enumerate(1e-5 * np.eye(3)):
        slope = (fit(small).unlikely.sum() - fit(-small).unlikely.sum()) / 2e-5
        assert slope == pytest.approx(-2 * towards[number], rel=0.02, abs=0.02)


def test_a_power_that_was_not_received_is_a_bound():
    powers = rice(0.01)
    powers[0, 0] = np.nan
    gains = np.abs(TRACED) ** 2
    gains[0, 0] = 1e-9
    judged = likelihood(powers, floor=-60.0)
    weak, strong = gains.copy(), gains.copy()
    weak[0, 0], strong[0, 0] = 1e-10, 1e-4
    unlikely = [judged.given(each, 0.01, 1.0).unlikely[0] for each in (gains, weak, strong)]
    assert unlikely[0] == pytest.approx(unlikely[1], abs=0.1)
    assert unlikely[2] > unlikely[0] + 50


def test_guesses_are_judged_as_single_fits_are():
    judged, gains = likelihood(rice(0.1)), np.abs(TRACED[:, :1].T) ** 2
    found = judged.of_guesses(0, np.sqrt(np.vstack([gains, np.roll(gains, 1)]))[..., None])
    alone = PowerResidual(judged.powers[:, :1], judged.floor, SCALES[:, :1], judged.weights)
    assert found[0] == pytest.approx(alone.given(gains.T, 0.1, NOISES[0]).unlikely[0])
    assert found[1] > found[0]
