"""What the grey levels of a picture stand for: the magnitude of a spectrum, its power, or its power in decibels.

The power S² of a spectrum is a sum of the array's lag functions (``simulate.spectra.lags``). So pictures p of power are
such sums themselves, pictures of magnitude as (p + b)² with an offset b, and pictures in decibels as 10^(pR/10) with
the range R from black to white. What the lag functions leave of each tells which of these the pictures are.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from jaxtyping import Float

from simulate.spectra.beamformer import Beamformer
from simulate.spectra.lags import LagSpace, fit_lags
from simulate.spectra.spectrum import LARGEST_GREY, normalise

PictureScale = Literal["magnitude", "power", "decibels"]

RANGES = np.array([10.0, 15, 20, 25, 30, 35, 40, 50, 60])
"""Ranges from black to white to try for pictures in decibels. At larger ones few pixels count, and any array fits."""

WIDEST = 80.0
"""Largest range of a single picture, for one with a deep null."""

RANGE_STEPS = 12
"""Steps by which the range of each picture is refined. Each divides the interval by 1.6."""

DB = np.log(10) / 10


def power_residual(space: LagSpace, spectra: Float[np.ndarray, "K 90 360"]) -> Float[np.ndarray, " K"]:
    """What an array leaves unexplained of spectra that would be powers: root mean square, grey levels."""
    left = space.remainder(space.sampled(spectra))
    return LARGEST_GREY * np.sqrt((left**2).sum(axis=1) / space.freedom)


def decibel_residual(
    space: LagSpace, spectra: Float[np.ndarray, "K 90 360"], steps: int = RANGE_STEPS
) -> tuple[Float[np.ndarray, " K"], Float[np.ndarray, " K"]]:
    """The same for spectra in decibels, and the range from black to white that leaves least of each, in decibels.

    The error of a power is divided by the derivative of the power by the grey level. Both are squared and averaged
    first, so that bright pixels count most and the floor, at which many programs cut, counts least.
    """
    values = space.sampled(spectra)

    def residual(decibels: Float[np.ndarray, " K"]) -> Float[np.ndarray, " K"]:
        power = 10 ** ((values - 1) * decibels[:, None] / 10)
        left = (space.remainder(power) ** 2).sum(axis=1) / space.freedom
        return LARGEST_GREY * np.sqrt(left / (power**2).mean(axis=1)) / (DB * decibels)

    tried = np.stack([residual(np.full(len(values), each)) for each in RANGES])
    best = tried.argmin(axis=0)
    if not steps:
        return tried.min(axis=0), RANGES[best]
    low, high = RANGES[np.maximum(best - 1, 0)], np.append(RANGES[1:], WIDEST)[best]
    golden = (5**0.5 - 1) / 2
    for _ in range(steps):  # golden-section search, all pictures at once
        left, right = high - golden * (high - low), low + golden * (high - low)
        lower = residual(left) < residual(right)
        low, high = np.where(lower, low, left), np.where(lower, right, high)
    decibels = (low + high) / 2
    return residual(decibels), decibels


def median_residual(
    spectra: Float[np.ndarray, "K 90 360"], beamformer: Beamformer, scale: PictureScale, steps: int = RANGE_STEPS
) -> float:
    """Median of the root mean square errors that an array leaves on spectra of a scale, grey levels."""
    if scale == "magnitude":
        return fit_lags(spectra, beamformer).median_residual
    space = LagSpace.of(beamformer)
    if scale == "power":
        return float(np.median(power_residual(space, spectra)))
    return float(np.median(decibel_residual(space, spectra, steps)[0]))


def magnitudes(
    spectra: Float[np.ndarray, "K 90 360"], scale: PictureScale, decibels: Float[np.ndarray, " K"] | None = None
) -> Float[np.ndarray, "K 90 360"]:
    """Turn pictures of a scale into normalised magnitudes.

    Example:
        >>> power, level = np.array([[[0.25, 0.0, 1.0]]]), np.array([[[0.5, 0.0, 1.0]]])
        >>> magnitudes(power, "power").tolist()
        [[[0.5, 0.0, 1.0]]]
        >>> magnitudes(level, "decibels", np.array([40.0])).round(4).tolist()
        [[[0.0909, 0.0, 1.0]]]
    """
    if scale == "magnitude":
        return spectra
    if scale == "power":
        return np.sqrt(spectra)
    assert decibels is not None
    return normalise(10 ** ((spectra - 1) * decibels[:, None, None] / 20))
