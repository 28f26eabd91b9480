"""Regression of positions on fingerprints of channels (a Gaussian process), which ignore level, phase and timing."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float, Int
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize
from scipy.stats import chi2

from learn.channels.known_channels import strongest_ramp, without_ramp
from learn.localisation.located_places import Place
from learn.planning.candidates import extended_axes

DIRECTIONS = 8  # Directions of beams per antenna. A planar array sees half of them twice.

MOST_DIRECTIONS = 256  # Largest number of directions

FINER = 2  # Delays per subcarrier

MOST_DELAYS = 64  # Largest number of delays: those with the largest mean power of the known rows

LEAST_POWER = 0.01
"""Added to powers before the logarithm, as a share of a row's mean power. Weaker ones are side lobes or noise."""


class Fingerprint(NamedTuple):
    """Two fingerprints of n rows."""

    # channels of length 1 whose strongest delay is taken off; the squared scalar product of two tells whether they
    # agree phase by phase, as only places within a fraction of a wavelength do
    waves: Complex[np.ndarray, "n E"]
    # powers of directions and delays, dB, which also tell places that are farther apart
    powers: Float[np.ndarray, "n F"]


class ChannelFingerprints:
    """Fingerprints of the channels of one base station."""

    def __init__(
        self, antennas: Float[np.ndarray, "A 3"], wavelength: float, known: Complex[np.ndarray, "n A S"]
    ) -> None:
        directions = _over_a_sphere(min(DIRECTIONS * len(antennas), MOST_DIRECTIONS))
        self._beams = np.exp(-2j * np.pi / wavelength * directions @ (antennas - antennas.mean(axis=0)).T)
        self._delays = np.arange(FINER * known.shape[2])
        if len(self._delays) > MOST_DELAYS:
            delayed = np.fft.ifft(_level(known), FINER * known.shape[2], axis=2)
            power = np.square(np.abs(delayed)).sum(axis=(0, 1))
            self._delays = np.sort(power.argsort()[-MOST_DELAYS:])

    def of(self, channels: Complex[np.ndarray, "n A S"]) -> Fingerprint:
        """Fingerprints of channels, none of them zero."""
        level = _level(channels)
        waves = level.reshape(len(level), -1)
        return Fingerprint(waves, np.stack([self._powers(row) for row in level]))

    def _powers(self, row: Complex[np.ndarray, "A S"]) -> Float[np.ndarray, " F"]:
        delayed = np.fft.ifft(row, FINER * row.shape[1], axis=1)[:, self._delays]
        power = np.square(np.abs(self._beams @ delayed)).ravel()
        return 10 * np.log10(power / power.mean() + LEAST_POWER)


def unlike(here: Fingerprint, there: Fingerprint) -> tuple[Float[np.ndarray, "n m"], Float[np.ndarray, "n m"]]:
    """How unlike fingerprints are: 1 − ``|ρ|²`` of the waves, and the mean squared difference of the powers, dB²."""
    waves = 1 - np.square(np.abs(here.waves.conj() @ there.waves.T))
    squares = (np.square(each.powers).sum(axis=1) for each in (here, there))
    powers = np.add.outer(*squares) - 2 * here.powers @ there.powers.T
    return np.maximum(waves, 0), np.maximum(powers, 0) / here.powers.shape[1]


def _level(channels: Complex[np.ndarray, "n A S"]) -> Complex[np.ndarray, "n A S"]:
    """Rows of length 1 without the delay of their strongest path."""
    scale = np.abs(channels).max(axis=(1, 2), keepdims=True)
    aligned = without_ramp(channels / scale, strongest_ramp(channels / scale))
    return aligned / np.linalg.norm(aligned.reshape(len(aligned), -1), axis=1)[:, None, None]


def _over_a_sphere(count: int) -> Float[np.ndarray, "count 3"]:
    """Unit vectors spread evenly over a sphere: a Fibonacci lattice."""
    number: Int[np.ndarray, " count"] = np.arange(count)
    height = 1 - (2 * number + 1) / count
    turn = np.pi * (1 + 5**0.5) * number
    across = np.sqrt(1 - height**2)
    return np.stack([across * np.cos(turn), across * np.sin(turn), height], axis=1)


FITTED_ON = 300  # Largest number of rows to which the covariance is fitted

STEPS = 25  # Most steps of the fit

MIDDLE = np.array([0.0, 0.0, 0.0, 0.0, -2.0])
WIDTH = np.array([2.0, 1.0, 2.0, 1.0, 2.0])
"""Middles and standard deviations of weak normal priors of the logarithms: share and scale of the waves, share and
scale of the powers, and noise. Scales are relative to the median of the known rows."""

JITTER = 1e-6

LEAST_VARIANCE = 1e-6
"""Square metres, along axes in which known positions have no extent; files have six decimals."""

REGION = 0.9  # Share of left-out positions that are to be within the stated region of this probability


class PositionRegression:
    """Positions as a function of fingerprints, with one covariance for all coordinates.

    Its parts fall exponentially with how unlike two fingerprints are. The parts' shares and scales are those of the
    greatest likelihood, times weak priors, of positions that are correlated normal along the axes of their extent.
    """

    def __init__(self, known: Fingerprint, positions: Float[np.ndarray, "n 3"]):
        self.known, self.positions = known, positions
        self._centre, self._axes = extended_axes(positions)
        along = (positions - self._centre) @ self._axes.T
        apart = unlike(known, known)
        self._scales = [max(float(np.median(each)), JITTER) for each in apart]
        chosen = np.random.default_rng(0).permutation(len(along))[:FITTED_ON]
        self._fit([each[np.ix_(chosen, chosen)] for each in apart], along[chosen])
        whole = self._covariance(apart)
        whole[np.diag_indices_from(whole)] += self._noise
        self._inverse = np.linalg.inv(whole)
        self._weights = self._inverse @ along
        self._spread = along.T @ self._weights / len(along)
        # Leaving out a row needs no new fit [dubrule1983].
        precision = np.diag(self._inverse)
        away = self._weights / precision[:, None]
        squared = np.einsum("ni,ij,nj->n", away, np.linalg.inv(self._spread), away) * precision
        self._spread *= float(np.quantile(squared, REGION)) / chi2.ppf(REGION, len(self._axes))

    def places(self, seen: Fingerprint) -> list[Place]:
        """The place of each transmitter."""
        apart = unlike(seen, self.known)
        near = self._covariance(apart)
        positions = self._centre + near @ self._weights @ self._axes
        whole = float(np.exp(self._given[[0, 2]]).sum()) + self._noise
        variances = np.maximum(whole - np.einsum("kn,nm,km->k", near, self._inverse, near, optimize=True), JITTER)
        spread = self._axes.T @ self._spread @ self._axes
        floor = LEAST_VARIANCE * np.eye(3)
        misfit = apart[0].min(axis=1)
        rows = zip(positions, variances, misfit, strict=True)
        return [Place(position, variance * spread + floor, 1.0, float(left)) for position, variance, left in rows]

    def _fit(self, apart: list[Float[np.ndarray, "m m"]], along: Float[np.ndarray, "m d"]) -> None:
        count, axes = along.shape

        def cost(given: Float[np.ndarray, " 5"]) -> float:
            self._given = given
            factor = cho_factor(self._covariance(apart) + self._noise * np.eye(count), lower=True)
            spread = along.T @ cho_solve(factor, along) / count
            prior = 0.5 * float(np.square((given - MIDDLE) / WIDTH).sum())
            return float(axes * np.log(np.diag(factor[0])).sum() + 0.5 * count * np.linalg.slogdet(spread)[1] + prior)

        self._given = minimize(cost, MIDDLE, method="L-BFGS-B", options={"maxiter": STEPS}).x

    @property
    def _noise(self) -> float:
        return float(np.exp(self._given[4])) + JITTER

    def _covariance(
        self, apart: tuple[Float[np.ndarray, "n m"], ...] | list[Float[np.ndarray, "n m"]]
    ) -> Float[np.ndarray, "n m"]:
        shares, scales = np.exp(self._given[[0, 2]]), np.exp(self._given[[1, 3]]) * self._scales
        parts = zip(shares, scales, apart, strict=True)
        return sum((share * np.exp(-each / scale) for share, scale, each in parts), np.zeros(apart[0].shape))
