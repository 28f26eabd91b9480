"""The covariance of powers over the place, and the one that suits known powers best by their likelihood."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
from jaxtyping import Float
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize
from scipy.spatial.distance import cdist
from scipy.special import spence

FADING_DB = 10 / np.log(10) * np.pi / np.sqrt(6)
"""Standard deviation of the power of a circular complex Gaussian response, dB."""

LARGEST_CORRELATION = 1 - 1e-12  # Keeps ln(1 − |κ|²) finite where two positions are the same


def fading_covariance(squared: Float[np.ndarray, "*shape"]) -> Float[np.ndarray, "*shape"]:
    """Covariance of two powers in dB, (10 / ln 10)² Li₂(|κ|²), as a share of the variance of each."""
    return spence(1 - squared) / (np.pi**2 / 6)  # scipy's spence(z) is Li₂(1 − z)


def squared_separations(here: Float[np.ndarray, "n 3"], there: Float[np.ndarray, "m 3"]) -> Float[np.ndarray, "3 n m"]:
    """Squared separations of positions along each axis, square metres."""
    return np.square(here.T[:, :, None] - there.T[:, None, :])


@dataclass(frozen=True)
class PowerCovariance:
    """Parts of a variance of 1 and their lengths."""

    # of slow change, fading and noise; their sum is 1. With a line of sight, the share of fading is smaller.
    shares: Float[np.ndarray, " 3"]
    slow: Float[np.ndarray, " 3"]  # lengths of a Matérn covariance of order 3/2 along x, y, z, metres
    # lengths along x, y, z over which |κ|² falls to 1 / e, as a Gaussian of the separation, metres
    fading: Float[np.ndarray, " 3"]

    @classmethod
    def of(cls, unbounded: Float[np.ndarray, " 8"]) -> PowerCovariance:
        """From numbers of any size: logarithms of two shares relative to that of noise, and of the six lengths."""
        shares = np.exp(np.append(unbounded[:2], 0.0) - max(0.0, *unbounded[:2]))
        return cls(shares / shares.sum(), np.exp(unbounded[2:5]), np.exp(unbounded[5:]))

    def __call__(self, here: Float[np.ndarray, "n 3"], there: Float[np.ndarray, "m 3"]) -> Float[np.ndarray, "n m"]:
        """Covariance between powers at different positions, metres."""
        distance = np.sqrt(3) * cdist(here / self.slow, there / self.slow)
        squared = np.exp(-cdist(here / self.fading, there / self.fading, "sqeuclidean"))
        return self.shares[0] * (1 + distance) * np.exp(-distance) + self.shares[1] * fading_covariance(squared)

    def with_gradient(
        self, separations: Float[np.ndarray, "3 n n"]
    ) -> tuple[Float[np.ndarray, "n n"], list[Float[np.ndarray, "n n"]]]:
        """Covariance of the known powers, with their noise, and its derivatives by the arguments of ``of``."""
        distance = np.sqrt(3 * np.tensordot(self.slow**-2.0, separations, 1))
        decay = np.exp(-distance)
        squared = np.minimum(np.exp(-np.tensordot(self.fading**-2.0, separations, 1)), LARGEST_CORRELATION)
        parts = [(1 + distance) * decay, fading_covariance(squared), np.eye(len(decay))]
        whole = np.tensordot(self.shares, parts, 1)
        by_share = [share * (part - whole) for share, part in zip(self.shares[:2], parts[:2], strict=True)]
        by_slow = 3 * self.shares[0] * decay * separations / np.square(self.slow)[:, None, None]
        steep = -2 * self.shares[1] * np.log1p(-squared) / (np.pi**2 / 6)
        by_fading = steep * separations / np.square(self.fading)[:, None, None]
        return whole, [*by_share, *by_slow, *by_fading]


FITTED_ON = 400
"""Largest number of positions to which the covariance is fitted; predictions use all of them."""

FIRST, ITERATIONS, WITHIN = 15, 60, 5.0
"""Most steps from each start and from the best one on, and how far they go from the middles of the priors, in their
standard deviations."""

LONGER = 8.0
"""Factor of the length of fading along one axis in the starts besides the middles of the priors. Where paths arrive
near the horizon, fading is slow along the vertical, and a search from equal lengths may end at another axis."""

JITTER = 1e-8  # Added to the diagonal of a covariance of variance 1, so that it can be factorised

LEAST_LENGTH = 1e-3  # Metres; positions that agree along an axis tell no length there

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
    """Maximise the likelihood of the powers of all gateways, times weak priors."""
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
