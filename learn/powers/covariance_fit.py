"""The covariance of powers that suits known ones best, found by their likelihood."""

from __future__ import annotations

from functools import partial

import numpy as np
from jaxtyping import Float
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize

from learn.powers.power_covariance import PowerCovariance, squared_separations

FITTED_ON = 400
"""Largest number of positions to which the covariance is fitted; predictions use all of them."""

FIRST, ITERATIONS, WITHIN = 15, 60, 5.0
"""Most steps from each start and from the best one on, and how far they go from the middles of the priors, in their
standard deviations."""

LONGER = 8.0
"""Factor of the length of fading along one axis in the starts besides the middles of the priors. Where paths arrive
near the horizon, fading is slow along the vertical, and a search from equal lengths may end at another axis."""

JITTER = 1e-8
"""Added to the diagonal of a covariance of variance 1, so that it can be factorised."""

LEAST_LENGTH = 1e-3
"""Metres; positions that agree along an axis tell no length there."""

WIDTHS = np.array([3.0, 3.0, 1.5, 1.5, 1.5, 1.0, 1.0, 1.0])
"""Standard deviations of the weak normal priors of the arguments of ``PowerCovariance.of``, which are logarithms.

They matter only where the powers tell nothing, as about the length of fading with few and distant positions.
"""


def expected(positions: Float[np.ndarray, "n 3"], wavelength: float) -> Float[np.ndarray, " 8"]:
    """Middles of the priors: ten parts of noise hold 27 of slow change and of fading each. The lengths are a quarter of
    the region and of the wavelength, over which |κ|² of waves from all sides in a plane falls to about 1 / e.
    """
    slow = np.maximum(np.ptp(positions, axis=0) / 4, LEAST_LENGTH)
    return np.concatenate([[1.0, 1.0], np.log(slow), np.full(3, np.log(wavelength / 4))])


def fit_covariance(
    positions: Float[np.ndarray, "n 3"], left: Float[np.ndarray, "n G"], wavelength: float, seed: int
) -> PowerCovariance:
    """Maximise the likelihood of the powers of all gateways, times weak priors.

    The gateways have one covariance, up to a variance of each, which is the most likely one at every step.
    """
    middle = expected(positions, wavelength)
    left = left[:, np.ptp(left, axis=0) > JITTER] if len(left) > 1 else left[:, :0]
    if not left.shape[1]:
        return PowerCovariance.of(middle)
    chosen = np.random.default_rng(seed).permutation(len(positions))[:FITTED_ON]
    separations, left = squared_separations(positions[chosen], positions[chosen]), left[chosen]

    def cost(given: Float[np.ndarray, " 8"]) -> tuple[float, Float[np.ndarray, " 8"]]:
        value, gradient = negative_log_likelihood(given, separations, left)
        away = (given - middle) / WIDTHS
        return value + 0.5 * float(away @ away), gradient + away / WIDTHS

    search = partial(minimize, cost, jac=True, method="L-BFGS-B")
    bounds = np.stack([middle - WITHIN * WIDTHS, middle + WITHIN * WIDTHS], axis=1)
    starts = [middle, *(middle + np.log(LONGER) * axis for axis in np.eye(8)[5:])]
    ends = [search(start, bounds=bounds, options={"maxiter": FIRST}) for start in starts]
    best = min(ends, key=lambda end: end.fun)
    return PowerCovariance.of(search(best.x, bounds=bounds, options={"maxiter": ITERATIONS}).x)


def negative_log_likelihood(
    given: Float[np.ndarray, " 8"], separations: Float[np.ndarray, "3 n n"], left: Float[np.ndarray, "n G"]
) -> tuple[float, Float[np.ndarray, " 8"]]:
    """−ln of the likelihood of G independent fields of one covariance, each of its likeliest variance, and gradient."""
    covariance, by_argument = PowerCovariance.of(given).with_gradient(separations)
    count, fields = left.shape
    factor = cho_factor(covariance + JITTER * np.eye(count), lower=True)
    weighted = cho_solve(factor, left)
    variance = np.maximum((left * weighted).sum(axis=0) / count, JITTER)
    value = fields * np.log(np.diag(factor[0])).sum() + 0.5 * count * np.log(variance).sum()
    slope = fields * cho_solve(factor, np.eye(count)) - (weighted / variance) @ weighted.T
    return float(value), np.array([0.5 * np.vdot(slope, each) for each in by_argument])
