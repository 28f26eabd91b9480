"""Received powers beside traced ones: the level and the share of fading are found, and bounds count as bounds."""

from types import SimpleNamespace

import numpy as np
import pytest

from learn.twin.power_likelihood import DB, NOISES, PowerLikelihood
from learn.twin.power_search import PowerSearch

GENERATOR = np.random.default_rng(0)
TRACED = (GENERATOR.normal(size=(400, 2, 2)) @ [1, 1j]) * [1e-3, 1e-4]
SCALES = np.full((400, 2), 2.0) * [1e-6, 1e-8]


def rice(share):
    """Powers, dBm, of traced responses and random ones, with levels of 10 and 30 dBm."""
    random = np.random.default_rng(1).normal(size=(400, 2, 2)) @ [1, 1j]
    return 20 * np.log10(np.abs(TRACED + random * np.sqrt(share * SCALES / 2))) + [10, 30]


def likelihood(powers, floor=-200.0):
    return PowerLikelihood(powers, floor, SCALES, np.ones(400))


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
    """By finite differences, where the responses are linear in unknowns of unequal priors; some powers are bounds."""
    generator = np.random.default_rng(6)
    jacobian, traced = (generator.normal(size=(12, 2, n, 2)) @ [1, 1j] for n in (3, 1))
    prior, values, scales = np.array([0.2, 0.02, 1.0]), np.array([0.1, 0.03, -0.5]), np.abs(traced[..., 0]) ** 2
    powers = DB * np.log(scales) + generator.normal(0, 3, (12, 2)) - 60
    powers[::3] = np.nan
    likelihood = PowerLikelihood(powers, -60.0, scales, np.ones(12))
    which = [SimpleNamespace(tolerance=each) for each in prior]
    search = PowerSearch({}, which, np.zeros((12, 3)), likelihood, print)

    def fit(step):
        responses = traced[..., 0] + jacobian @ step
        return likelihood.given(np.abs(responses) ** 2, 1e-5, 4.0), responses

    def unlikely(step):
        return fit(step)[0].unlikely.sum() + (((values + step) / prior) ** 2).sum()

    model = search._quadratic(*fit(np.zeros(3)), jacobian, values)
    for number, small in enumerate(1e-5 * np.diag(prior)):
        slope = (unlikely(small) - unlikely(-small)) / 2e-5
        assert slope == pytest.approx(-2 * model.towards[number], rel=0.02, abs=0.02)


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
    found = judged.of_guesses(0, np.vstack([gains, np.roll(gains, 1)]))
    alone = PowerLikelihood(judged.powers[:, :1], judged.floor, SCALES[:, :1], judged.weights)
    assert found[0] == pytest.approx(alone.given(gains.T, 0.1, NOISES[0]).unlikely[0])
    assert found[1] > found[0]
