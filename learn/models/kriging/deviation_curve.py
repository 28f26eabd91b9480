"""The stated deviation over the kriging variance, told by predictions of known positions that were left out.

A covariance that is fitted to the positions that it interpolates is too sure of itself, and errors have longer tails
than those of a normal distribution. So the variance only sorts predictions, and left-out ones tell what it means.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import Complex, Float, Int
from scipy.optimize import isotonic_regression

from simulate.spectra.spectrum import evenly

SHARE, NORMAL = 0.9, 1.6449  # share of the errors that lie within ``NORMAL`` deviations, as in a normal distribution

KNOTS, LEAST_IN_KNOT = 8, 10
"""Largest number of groups of predictions of like variance, and the least number of predictions in one of several."""


def size_of(errors: Float[np.ndarray, "*n P"]) -> Float[np.ndarray, "*n"]:
    """The standard deviation of a normal distribution that has as many errors within its 90 % interval."""
    return np.quantile(np.abs(errors), SHARE, axis=-1) / NORMAL


def normal_curve(noise: float) -> tuple[Float[np.ndarray, " k"], Float[np.ndarray, " k"]]:
    """The curve of a normal distribution: of the real and the imaginary part, half of the variance and of the noise."""
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
    """The deviations on a curve, between whose points their squares are straight lines."""
    return np.sqrt(np.interp(variance, variances, np.square(deviations)))


LEFT_OUT = 48  # largest number of known positions, evenly spread, that are predicted from the others

RADII = (0.0, 0.25, 0.5, 1.0, 2.0, 4.0)
"""Known positions nearer than each of these radii are left out with them, wavelengths."""

LEAST_LEFT = 8  # a prediction from fewer positions than this tells nothing, unless no more are known
LEAST_KNOWN = 3  # with fewer known positions, the covariance tells the deviations

FOLDS, FOLDED = 5, 300
"""If few positions are known, a covariance fitted to all of them predicts them too well. They are then divided into
parts, and each part is predicted with a covariance fitted without it. There are FOLDED // n parts for n known
positions, at most FOLDS; if these are fewer than 2, the covariance is not fitted again."""

FITTED = "shares", "length", "drift", "nugget", "noises"  # what the fit of the covariance sets


def left_out_curve(
    field: Any, responses: Complex[np.ndarray, "n elements subcarriers"]
) -> tuple[Float[np.ndarray, " k"], Float[np.ndarray, " k"]]:
    """The deviations of a ``BandField`` over its kriging variance, as for ``rising_curve``."""
    count = len(responses)
    if count < LEAST_KNOWN:
        return normal_curve(field.noise)
    members, folds, told = evenly(np.arange(count), LEFT_OUT), min(FOLDS, FOLDED // count), []
    fitted = [getattr(field, name) for name in FITTED]
    for fold in range(folds if folds > 1 else 0):
        field.fit_covariance(np.flatnonzero(np.arange(count) % folds != fold))
        part = members[members % folds == fold]
        if len(part):
            told.append(_left_out(field, part, responses))
    for name, each in zip(FITTED, fitted, strict=True):
        setattr(field, name, each)
    told = told or [_left_out(field, members, responses)]
    variance, errors = (np.concatenate(each) for each in zip(*told, strict=True))
    return rising_curve(variance, errors, np.sqrt(field.noise / 2), float(size_of(responses.view(float).ravel())))


def _left_out(
    field: Any, members: Int[np.ndarray, " n"], responses: Complex[np.ndarray, "N elements subcarriers"]
) -> tuple[Float[np.ndarray, " m"], Float[np.ndarray, "m P"]]:
    """Variances and errors (real and imaginary parts) of known positions predicted from those beyond each radius."""
    places, variances, errors = field.places.numpy(), [], []
    distance = np.linalg.norm(places[members][:, None] - places, axis=2)
    distance[np.arange(len(members)), members] = -1
    for radius in np.array(RADII) * float(field.wavelength):
        some = members[np.count_nonzero(distance >= radius, axis=1) >= min(LEAST_LEFT, len(places) - 1)]
        if len(some):
            found, variance = field.with_variance(places[some], some, radius)
            error = found / float(field.level) - responses[some]
            variances.append(variance)
            errors.append(error.reshape(len(error), -1).view(float))
    return np.concatenate(variances), np.concatenate(errors)
