"""The stated deviation over the kriging variance, told by predictions of known positions that were left out.

A covariance that is fitted to the positions that it interpolates is too sure of itself, and errors have longer tails
than those of a normal distribution. So the variance only sorts predictions, and left-out ones tell what it means.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from scipy.optimize import isotonic_regression

SHARE, NORMAL = 0.9, 1.6449
"""Share of the errors that lie within ``NORMAL`` deviations, as in a normal distribution."""

KNOTS, LEAST_IN_KNOT = 8, 10
"""Largest number of groups of predictions of like variance, and the least number of predictions in one of several."""


def size_of(errors: Float[np.ndarray, "*n P"]) -> Float[np.ndarray, "*n"]:
    """The standard deviation of a normal distribution that has as many errors within its 90 % interval.

    >>> bool(abs(size_of(0.2 * np.random.default_rng(0).normal(size=100_000)) - 0.2) < 0.002)
    True
    """
    return np.quantile(np.abs(errors), SHARE, axis=-1) / NORMAL


def normal_curve(noise: float) -> tuple[Float[np.ndarray, " k"], Float[np.ndarray, " k"]]:
    """The curve of a normal distribution: of the real and the imaginary part, half of the variance and of the noise.

    >>> [each.round(3).tolist() for each in normal_curve(0.02)]
    [[0.0, 1.0], [0.1, 0.714]]
    """
    return np.array([0.0, 1.0]), np.sqrt(np.array([noise, 1 + noise]) / 2)


def rising_curve(
    variance: Float[np.ndarray, " m"], errors: Float[np.ndarray, "m P"], least: float, nothing: float
) -> tuple[Float[np.ndarray, " k"], Float[np.ndarray, " k"]]:
    """The deviations within 1.645 of which lie nine tenths of the errors of like variance; they never fall.

    >>> drawn = np.random.default_rng(0).normal(size=(40, 2000)) * np.repeat([0.1, 0.4], 20)[:, None]
    >>> curve = rising_curve(np.repeat([0.1, 0.5], 20), drawn, 0.05, 1.0)
    >>> [each.round(2).tolist() for each in curve]
    [[0.0, 0.1, 0.5, 1.0], [0.05, 0.1, 0.4, 1.0]]
    """
    order = np.argsort(variance, kind="stable")
    count = max(1, min(KNOTS, len(np.unique(variance)), len(order) // LEAST_IN_KNOT))
    groups = np.array_split(order, count)
    sizes = [float(size_of(errors[group].ravel())) for group in groups]
    rising = isotonic_regression(sizes, weights=[len(group) for group in groups]).x
    means = np.array([variance[group].mean() for group in groups])
    ends = min(least, rising[0]), max(nothing, rising[-1])
    return np.array([0.0, *means, 1.0]), np.array([ends[0], *rising, ends[1]])


def on_curve(
    variance: Float[np.ndarray, " K"], variances: Float[np.ndarray, " k"], deviations: Float[np.ndarray, " k"]
) -> Float[np.ndarray, " K"]:
    """The deviations on a curve, between whose points their squares are straight lines.

    >>> on_curve(np.array([0.0, 0.5]), np.array([0.0, 1.0]), np.array([0.0, 2.0])).round(3).tolist()
    [0.0, 1.414]
    """
    return np.sqrt(np.interp(variance, variances, np.square(deviations)))
