"""How likely received powers are, given the traced responses: a distribution in dB that knows deep fades.

The field at a position is taken to be the traced response y plus a random one of the power σ², which stands for all
that the description lacks. Its power then follows a Rice distribution. In dB this is narrow where ``|y|²`` is much
larger than σ², and as wide as fading in a fade of y, where a small error of y changes the power by many dB.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.special import log_ndtr

DB = 10 / np.log(10)  # Decibels per unit of the natural logarithm of a power

FADING_DB = DB * np.pi / np.sqrt(6)
"""Standard deviation of a power whose field is a complex Gaussian, dB."""

MEAN_OF_FADING = np.exp(-np.euler_gamma)
"""exp of the mean logarithm of a fading power, relative to its mean."""

SHARES = (0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0)
"""Candidates for σ², relative to the sum of the powers of the traced paths."""

NOISES = (1.0, 2.0, 4.0)
"""Candidates for the standard deviation of what is neither traced nor fading, such as shadowing and steps, dB."""

STEPS = 5  # Newton steps to the levels of the gateways

TINY = 1e-30  # Power that stands for that of no path


class PowerFit(NamedTuple):
    """Received powers of K positions and G gateways beside traced ones."""

    unlikely: Float[np.ndarray, " G"]  # −2 log of the likelihood of the powers of each gateway, up to a constant
    slopes: Float[np.ndarray, "K G"]  # derivatives of the log likelihood with respect to the expected powers, 1/dB
    curvatures: Float[np.ndarray, "K G"]  # its negative second derivatives, 1/dB²
    expected: Float[np.ndarray, "K G"]  # expected powers, dBm
    softened: Float[np.ndarray, "K G"]  # |y|² plus the part of σ² that counts in the expected powers, without level
    levels: Float[np.ndarray, " G"]  # of the gateways: what is added to path gains, dBm
    share: float  # σ², relative to the sum of the powers of the traced paths

    def predicted(self, gains: Float[np.ndarray, "P G"], scales: Float[np.ndarray, "P G"]) -> Float[np.ndarray, "P G"]:
        """Expected powers at other positions, dBm, from traced gains |y|² and sums of the powers of their paths."""
        return DB * np.log(gains + MEAN_OF_FADING * (self.share * scales + TINY)) + self.levels


@dataclass(frozen=True)
class PowerLikelihood:
    """The likelihood of received powers."""

    powers: Float[np.ndarray, "K G"]  # received powers, dBm; NaN where nothing was received, which is a bound
    floor: float  # the bound, dBm
    scales: Float[np.ndarray, "K G"]  # sums of the powers of the traced paths, linear
    # how much each position counts; less than 1 where others are within a wavelength of it
    weights: Float[np.ndarray, " K"]

    def best(self, gains: Float[np.ndarray, "K G"]) -> PowerFit:
        """The fit with the most likely levels, σ² and noise."""
        return min(
            (self.given(gains, share, noise) for share in SHARES for noise in NOISES),
            key=lambda fit: float(fit.unlikely.sum()),
        )

    def of_guesses(self, gateway: int, gains: Float[np.ndarray, "G K"]) -> Float[np.ndarray, " G"]:
        """−2 log of the likelihood of one gateway's powers for each of G guesses, each with its most likely σ²."""
        powers, scales = (each[:, [gateway]].repeat(len(gains), axis=1) for each in (self.powers, self.scales))
        alone = PowerLikelihood(powers, self.floor, scales, self.weights)
        return np.min([alone.given(gains.T, share, NOISES[0]).unlikely for share in SHARES], axis=0)

    def given(self, gains: Float[np.ndarray, "K G"], share: float, noise: float) -> PowerFit:
        """The fit with given σ² and noise, and the most likely levels."""
        random = share * self.scales + TINY
        softened = gains + MEAN_OF_FADING * random
        ratio = FADING_DB**2 / (2 * DB**2)  # makes the variance that of strong responses, 2 DB² σ²/|y|², in its limit
        deviations = np.sqrt(noise**2 + FADING_DB**2 / (1 + ratio * gains / random))
        traced = DB * np.log(softened)
        levels = _median_of_heard(self.powers - traced)
        for _ in range(STEPS):
            _, slopes, curvatures = self._terms(traced + levels, deviations)
            weighted = np.einsum("k,kg->g", self.weights, curvatures)
            levels = levels + np.einsum("k,kg->g", self.weights, slopes) / np.maximum(weighted, TINY)
        unlikely, slopes, curvatures = self._terms(traced + levels, deviations)
        weights, expected = self.weights[:, None], traced + levels
        slopes, curvatures = weights * slopes, weights * curvatures
        return PowerFit((weights * unlikely).sum(axis=0), slopes, curvatures, expected, softened, levels, share)

    def _terms(
        self, expected: Float[np.ndarray, "K G"], deviations: Float[np.ndarray, "K G"]
    ) -> tuple[Float[np.ndarray, "K G"], Float[np.ndarray, "K G"], Float[np.ndarray, "K G"]]:
        """−2 log likelihood of each power, slope of the log likelihood, and its negative curvature."""
        off = (self.powers - expected) / deviations
        below = (self.floor - expected) / deviations
        bound = log_ndtr(below)
        hazard = np.exp(-(below**2) / 2 - bound) / np.sqrt(2 * np.pi)
        heard = ~np.isnan(off)
        unlikely = np.where(heard, off**2 + 2 * np.log(deviations), -2 * bound)
        slopes = np.where(heard, off, -hazard) / deviations
        curvatures = np.where(heard, 1.0, hazard * (hazard + below)) / deviations**2
        return unlikely, slopes, curvatures


def _median_of_heard(values: Float[np.ndarray, "K G"]) -> Float[np.ndarray, " G"]:
    """Median of each column without NaN; 0 for a column of NaN alone."""
    ordered, counts = np.sort(values, axis=0), (~np.isnan(values)).sum(axis=0)  # NaN come last
    return np.nan_to_num(np.take_along_axis(ordered, np.maximum(counts - 1, 0)[None] // 2, axis=0)[0])
