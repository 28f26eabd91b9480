"""Responses over a band from those at a few of its frequencies."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Complex, Float
from scipy.interpolate import barycentric_interpolate


def chebyshev_points(first: float, last: float, count: int) -> Float[np.ndarray, " count"]:
    """The points between two frequencies from which polynomials interpolate best, rising, Hz.

    >>> chebyshev_points(-1.0, 1.0, 3).round(3).tolist()
    [-0.866, -0.0, 0.866]
    """
    return (first + last) / 2 - (last - first) / 2 * np.cos(np.pi * (np.arange(count) + 0.5) / count)


def enough_frequencies(
    frequencies: Float[np.ndarray, " subcarriers"], delay: float, more: int
) -> Float[np.ndarray, " n"]:
    """The subcarriers, or fewer frequencies if these tell as much.

    Responses whose delays span the time T turn at most BT times over a band of the width B.

    >>> len(enough_frequencies(np.linspace(0, 20e6, 64), 100e-9, 8)), len(enough_frequencies(np.ones(4), 1.0, 8))
    (12, 4)
    """
    count = math.ceil(np.pi / 2 * np.ptp(frequencies) * delay) + more
    return chebyshev_points(frequencies[0], frequencies[-1], count) if count < len(frequencies) else frequencies


def interpolated(
    at: Float[np.ndarray, " n"],
    values: Complex[np.ndarray, "*batch n"],
    frequencies: Float[np.ndarray, " subcarriers"],
    delay: float,
) -> Complex[np.ndarray, "*batch subcarriers"]:
    """Responses at the frequencies of a band, from those at a few frequencies of it."""
    if np.array_equal(at, frequencies):
        return values
    turned = values * np.exp(2j * np.pi * delay * at)
    weights = np.stack([barycentric_interpolate(at, each, frequencies) for each in np.eye(len(at))])
    return turned @ weights * np.exp(-2j * np.pi * delay * frequencies)
