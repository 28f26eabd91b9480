"""Channels (CSI) as evidence of places: positions are a Gaussian process over fingerprints of known rows.

Fingerprints ignore the level, the common phase and the timing of a row, so that these need no calibration.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Complex, Float
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize
from scipy.stats import chi2

from learn.channels.known_channels import strongest_ramp, without_ramp
from learn.localisation.evidence import Evidence
from learn.localisation.located_places import REGION
from learn.models.encoding import evenly_spread_directions
from learn.planning.candidates import extended_axes
from scenes.scene.shapes import bounding_box

DIRECTIONS, MOST_DIRECTIONS = 8, 256
"""Directions of beams per antenna, and of all of them at most. A planar array sees half of them twice."""

FINER, MOST_DELAYS = 2, 64  # Delays per subcarrier; at most: those with the largest mean power of the known rows

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
        self.directions = evenly_spread_directions(min(DIRECTIONS * len(antennas), MOST_DIRECTIONS)).double().numpy()
        self._beams = np.exp(-2j * np.pi / wavelength * self.directions @ (antennas - antennas.mean(axis=0)).T)
        self._delays = np.arange(FINER * known.shape[2])
        if len(self._delays) > MOST_DELAYS:
            power = np.square(np.abs(np.fft.ifft(_level(known), FINER * known.shape[2], axis=2))).sum(axis=(0, 1))
            self._delays = np.sort(power.argsort()[-MOST_DELAYS:])

    def of(self, channels: Complex[np.ndarray, "n A S"]) -> Fingerprint:
        """Fingerprints of channels, none of them zero."""
        level = _level(channels)
        powers = [self._powers(row) for row in level]
        return Fingerprint(level.reshape(len(level), -1), np.stack(powers))

    def _powers(self, row: Complex[np.ndarray, "A S"]) -> Float[np.ndarray, " F"]:
        delayed = np.fft.ifft(row, FINER * row.shape[1], axis=1)[:, self._delays]
        power = np.square(np.abs(self._beams @ delayed)).ravel()
        return 10 * np.log10(power / power.mean() + LEAST_POWER)


def _level(channels: Complex[np.ndarray, "n A S"]) -> Complex[np.ndarray, "n A S"]:
    """Rows of length 1 without the delay of their strongest path."""
    scale = np.abs(channels).max(axis=(1, 2), keepdims=True)
    aligned = without_ramp(channels / scale, strongest_ramp(channels / scale))
    return aligned / np.linalg.norm(aligned.reshape(len(aligned), -1), axis=1)[:, None, None]


def unlike(here: Fingerprint, there: Fingerprint) -> tuple[Float[np.ndarray, "n m"], Float[np.ndarray, "n m"]]:
    """How unlike fingerprints are: 1 − ``|ρ|²`` of the waves, and the mean squared difference of the powers, dB²."""
    waves = 1 - np.square(np.abs(here.waves.conj() @ there.waves.T))
    squares = (np.square(each.powers).sum(axis=1) for each in (here, there))
    powers = np.add.outer(*squares) - 2 * here.powers @ there.powers.T
    return np.maximum(waves, 0), np.maximum(powers, 0) / here.powers.shape[1]


FITTED_ON = 300  # Largest number of rows to which the covariance is fitted

STEPS = 25  # Most steps of the fit

MIDDLE = np.array([0.0, 0.0, 0.0, 0.0, -2.0])
WIDTH = np.array([2.0, 1.0, 2.0, 1.0, 2.0])
"""Middles and standard deviations of weak normal priors of the logarithms: share and scale of the waves, share and
scale of the powers, and noise. Scales are relative to the median of the known rows."""

JITTER = 1e-6

FARTHEST = 3.0  # Deviations of a position from the regression up to which places are searched


class ChannelEvidence(Evidence):
    """The position as a function of fingerprints, with one covariance for all coordinates [rasmussen2006].

    Its parts fall exponentially with how unlike two fingerprints are. The parts' shares and scales are those of the
    greatest likelihood, times weak priors, of positions that are correlated normal along the axes of their extent. The
    likelihood at a point is the normal density of the regression.
    """

    most = 2000

    def __init__(
        self,
        heard: Complex[np.ndarray, "K A S"],
        positions: Float[np.ndarray, "n 3"],
        uplink: Complex[np.ndarray, "n A S"],
        antennas: Float[np.ndarray, "A 3"],
        wavelength: float,
    ):
        fingerprints = ChannelFingerprints(antennas, wavelength, uplink)
        known = fingerprints.of(uplink)
        self._centre, self._axes = extended_axes(positions)
        along, apart = (positions - self._centre) @ self._axes.T, unlike(known, known)
        self._scales = [max(float(np.median(each)), JITTER) for each in apart]
        chosen = np.random.default_rng(0).permutation(len(along))[:FITTED_ON]
        self._fit([each[np.ix_(chosen, chosen)] for each in apart], along[chosen])
        inverse = np.linalg.inv(self._covariance(apart) + self._noise * np.eye(len(along)))
        weights = inverse @ along
        spread = along.T @ weights / len(along)
        # Leaving out a row needs no new fit [dubrule1983]. These rows set how wide the stated regions are.
        off = weights / np.diag(inverse)[:, None]
        squared = np.einsum("ni,ij,nj->n", off, np.linalg.inv(spread), off) * np.diag(inverse)
        self._precision = (
            np.linalg.inv(spread) * chi2.ppf(REGION, len(self._axes)) / float(np.quantile(squared, REGION))
        )
        self._sent = np.any(heard != 0, axis=(1, 2))
        self._apart = np.ones((len(heard), len(positions)))
        found = np.zeros((len(heard), len(self._axes) + 2))  # mean along the axes, variance, and misfit
        if self._sent.any():
            to_known = unlike(fingerprints.of(heard[self._sent]), known)
            near = self._covariance(to_known)
            whole = float(np.exp(self._given[[0, 2]]).sum()) + self._noise
            variances = np.maximum(whole - np.einsum("kn,nm,km->k", near, inverse, near, optimize=True), JITTER)
            self._apart[self._sent] = to_known[0]
            found[self._sent] = np.column_stack([near @ weights, variances, to_known[0].min(axis=1)])
        means = self._centre + found[self._sent, :-2] @ self._axes
        wide = FARTHEST * np.sqrt(np.diag(self._axes.T @ spread @ self._axes) * found[:, -2].max(initial=0))
        box = bounding_box(np.concatenate([positions, means - wide, means + wide]))
        super().__init__(found, box, wavelength, positions)

    @property
    def told(self) -> Bool[np.ndarray, " K"]:
        """Transmitters whose channels are not all zero."""
        return self._sent

    def log_likelihood(
        self, points: Float[np.ndarray, "n 3"], heard: Float[np.ndarray, "k d+2"]
    ) -> Iterator[Float[np.ndarray, " n"]]:
        """By the distance from the regression's position."""
        along = (points - self._centre) @ self._axes.T
        for row in heard:
            off = along - row[:-2]
            yield -np.einsum("ni,ij,nj->n", off, self._precision, off) / (2 * row[-2])

    def misfit(self, points: Float[np.ndarray, "n 3"], row: Float[np.ndarray, " d+2"]) -> Float[np.ndarray, " n"]:
        """1 − ``|ρ|²`` for the correlation ρ with the most similar known row, whatever the point."""
        return np.full(len(points), row[-1])

    def unlike(self) -> Float[np.ndarray, "K n"]:
        """1 − ``|ρ|²`` for the correlation ρ with each known row."""
        return self._apart

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
