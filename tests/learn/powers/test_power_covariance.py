"""The covariance of fading against Monte Carlo, and the gradient of the likelihood against differences."""

import numpy as np
import pytest

from learn.powers.power_covariance import (
    FADING_DB,
    PowerCovariance,
    fading_covariance,
    fit_covariance,
    negative_log_likelihood,
    squared_separations,
)


@pytest.mark.parametrize("kappa", [0.3, 0.7, 0.95])
def test_fading_covariance_is_that_of_simulated_responses(kappa):
    generator = np.random.default_rng(0)
    draw = lambda: generator.normal(size=400_000) + 1j * generator.normal(size=400_000)  # noqa: E731
    one = draw()
    other = kappa * np.exp(0.4j) * one + np.sqrt(1 - kappa**2) * draw()
    powers = 20 * np.log10(np.abs([one, other]))
    found = np.cov(powers)
    assert found[0, 0] == pytest.approx(FADING_DB**2, rel=0.01)
    assert found[0, 1] / FADING_DB**2 == pytest.approx(fading_covariance(np.array(kappa**2)), abs=0.01)


def test_the_covariance_between_places_is_that_of_the_known_ones_without_noise():
    at = np.random.default_rng(0).uniform(0, 1, (9, 3))
    covariance = PowerCovariance(np.array([0.5, 0.3, 0.2]), np.array([0.4, 0.6, 2]), np.array([0.1, 0.2, 0.3]))
    whole, _ = covariance.with_gradient(squared_separations(at, at))
    assert covariance(at, at) == pytest.approx(whole - 0.2 * np.eye(9))
    assert np.linalg.eigvalsh(whole).min() > 0.1


def test_gradient_of_the_likelihood():
    generator = np.random.default_rng(1)
    at, left = generator.uniform(0, 1, (15, 3)), generator.normal(0, 5, (15, 2))
    given = np.array([0.5, 1.0, -1, -0.5, 0, -1.5, -1, -2])
    separations = squared_separations(at, at)
    _, gradient = negative_log_likelihood(given, separations, left)
    for index, step in enumerate(1e-5 * np.eye(8)):
        up, down = (negative_log_likelihood(given + sign * step, separations, left)[0] for sign in (1, -1))
        assert gradient[index] == pytest.approx((up - down) / 2e-5, rel=1e-4, abs=1e-6)


def test_the_fit_finds_what_a_field_was_drawn_with():
    generator = np.random.default_rng(2)
    at = generator.uniform(0, 1, (150, 3))
    truth = PowerCovariance(np.array([0.45, 0.45, 0.1]), np.full(3, 0.5), np.full(3, 0.12))
    whole, _ = truth.with_gradient(squared_separations(at, at))
    left = np.linalg.cholesky(whole) @ generator.normal(size=(150, 12)) * np.linspace(2, 8, 12)
    found = fit_covariance(at, left, wavelength=0.3, seed=0)
    assert found.fading == pytest.approx(np.full(3, 0.12), rel=0.4) and found.slow == pytest.approx(0.5, rel=0.5)
    assert found.shares == pytest.approx(truth.shares, abs=0.15)


def test_powers_that_are_the_same_everywhere_tell_no_covariance():
    at = np.random.default_rng(0).uniform(0, 1, (5, 3))
    found = fit_covariance(at, np.zeros((5, 2)), 0.3, 0)
    assert found.fading == pytest.approx(0.075) and np.isfinite(found.slow).all()
    assert np.isfinite(fit_covariance(np.ones((5, 3)), np.eye(5), 0.3, 0).slow).all()
