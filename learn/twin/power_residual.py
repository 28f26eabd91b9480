"""How likely received powers are, given the traced responses: a distribution in dB that knows deep fades.

The field at a position is taken to be the traced response y plus a random one of the power σ², which stands for all
that the description lacks. Its power then follows a Rice distribution. In dB this is narrow where ``|y|²`` is much
larger than σ², and as wide as fading in a fade of y, where a small error of y changes the power by many dB.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float, Int
from scipy.special import log_ndtr

from learn.twin.response_residual import correlation
from simulate.rays.tracer import Tracer

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
    misfit: float  # median absolute error of the powers that were received, dB

    def predicted(self, tracers: Collection[Tracer], positions: Float[np.ndarray, "P 3"]) -> Float[np.ndarray, "P G"]:
        """Expected powers at other positions, dBm, by the tracer of each gateway. What the scene lacks fills fades."""
        gains, scales = path_powers(tracers, positions)
        return DB * np.log(gains + MEAN_OF_FADING * (self.share * scales + TINY)) + self.levels


def path_powers(
    tracers: Collection[Tracer], positions: Float[np.ndarray, "K 3"]
) -> tuple[Float[np.ndarray, "K G"], Float[np.ndarray, "K G"]]:
    """Path gains ``|y|²`` of gateways with one antenna, and the sums of the powers of their paths, both linear."""
    by_chain = [each.responses_by_chain(positions)[:, 0].astype(complex) for each in tracers]
    gains = np.stack([np.abs(each.sum(axis=1)) ** 2 for each in by_chain], axis=1)
    return gains, np.stack([(np.abs(each) ** 2).sum(axis=1) for each in by_chain], axis=1)


@dataclass(frozen=True)
class PowerResidual:
    """The likelihood of received powers."""

    powers: Float[np.ndarray, "K G"]  # received powers, dBm; NaN where nothing was received, which is a bound
    floor: float  # the bound, dBm
    scales: Float[np.ndarray, "K G"]  # sums of the powers of the traced paths, linear
    # how much each position counts; less than 1 where others are within a wavelength of it
    weights: Float[np.ndarray, " K"]

    @property
    def compared(self) -> Int[np.ndarray, " K"]:
        """Numbers of the positions at which guesses are compared."""
        return np.arange(len(self.powers))

    def fit(self, traced: Complex[np.ndarray, "K G"]) -> PowerFit:
        return self.best(np.abs(traced) ** 2)

    def best(self, gains: Float[np.ndarray, "K G"]) -> PowerFit:
        """The fit to path gains, with the most likely levels, σ² and noise."""
        fits = (self.given(gains, share, noise) for share in SHARES for noise in NOISES)
        best = min(fits, key=lambda fit: float(fit.unlikely.sum()))
        return best._replace(misfit=float(np.nanmedian(np.abs(self.powers - best.expected))))

    def in_words(self, misfit: float) -> str:
        return f"median error {misfit:.2f} dB"

    def quadratic(
        self, fit: PowerFit, traced: Complex[np.ndarray, "K G"], jacobian: Complex[np.ndarray, "K G n"]
    ) -> tuple[Float[np.ndarray, "n n"], Float[np.ndarray, " n"]]:
        """As ``Residual`` has it. With each step, the levels of the gateways follow."""
        slopes = 2 * DB * (traced.conj()[..., None] * jacobian).real / fit.softened[..., None]
        precision = np.einsum("kg,kgi,kgj->ij", fit.curvatures, slopes, slopes)
        by_level = np.einsum("kg,kgi->gi", fit.curvatures, slopes)
        sizes = np.maximum(fit.curvatures.sum(axis=0), TINY)
        precision -= np.einsum("gi,gj,g->ij", by_level, by_level, 1 / sizes)
        return precision, np.einsum("kg,kgi->i", fit.slopes, slopes)

    def of_guesses(self, gateway: int, found: Complex[np.ndarray, "G K 1"]) -> Float[np.ndarray, " G"]:
        """As ``Residual`` has it. Each guess has its most likely σ²."""
        gains = np.abs(found[..., 0].T) ** 2
        powers, scales = (each[:, [gateway]].repeat(len(found), axis=1) for each in (self.powers, self.scales))
        alone = PowerResidual(powers, self.floor, scales, self.weights)
        return np.min([alone.given(gains, share, NOISES[0]).unlikely for share in SHARES], axis=0)

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
        return PowerFit((weights * unlikely).sum(axis=0), slopes, curvatures, expected, softened, levels, share, np.nan)

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


def independence(positions: Float[np.ndarray, "K 3"], wavelength: float) -> Float[np.ndarray, " K"]:
    """How much each position counts beside the others: 1 / Σ ρ², with the correlation ρ of the twin's errors."""
    return 1 / (correlation(positions, wavelength) ** 2).sum(axis=1)
