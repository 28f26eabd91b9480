"""Known received powers, and the log-distance law of each gateway that is fitted to them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.special import log_ndtr

from simulate.dataset.dataset import Dataset

LEAST_DISTANCE = 0.01  # Metres; a transmitter at a gateway counts as this far away

FREE_SPACE = 2.0
"""Exponent n of a gateway whose powers tell none: all received ones come from one distance."""

UNHEARD_BELOW = 1.0  # dB by which a gateway that received nothing is taken to lie below the floor

ROUNDS, LEAST_CHANGE, LEAST_DEVIATION = 200, 1e-6, 1e-3
"""Most rounds of the fit to censored powers; change of the law (dB) that ends it; least standard deviation, dB."""


@dataclass(frozen=True)
class PathLoss:
    """A law for each of G gateways."""

    level: Float[np.ndarray, " G"]  # P₀, power at 1 m, dBm
    exponent: Float[np.ndarray, " G"]  # n. Free space has 2.
    deviation: Float[np.ndarray, " G"]  # standard deviation of the known powers about the law, dB

    @classmethod
    def fit(cls, distances: Float[np.ndarray, "n G"], powers: Float[np.ndarray, "n G"], floor: float) -> PathLoss:
        """Fit the laws by maximum likelihood, for deviations that are normal in dB.

        If everything was received, this is least squares. A power that was not received counts as one below the floor,
        by the expectation-maximisation algorithm [dempster1977].
        """
        laws = [_one(*each, floor) for each in zip(decades(distances).T, powers.T, strict=True)]
        return cls(*(np.array(each) for each in zip(*laws, strict=True)))

    @classmethod
    def shared(cls, distances: Float[np.ndarray, "n G"], powers: Float[np.ndarray, "n G"], floor: float) -> PathLoss:
        """One law for all gateways together; arguments as for ``fit``."""
        law = _one(decades(distances).ravel(), powers.ravel(), floor)
        return cls(*(np.full(powers.shape[1], each) for each in law))

    def __call__(self, distances: Float[np.ndarray, "K G"]) -> Float[np.ndarray, "K G"]:
        """The powers at distances in metres, dBm."""
        return self.level + self.exponent * decades(distances)

    def below(self, distances: Float[np.ndarray, "n G"], floor: float) -> Float[np.ndarray, "n G"]:
        """Expected power of a transmitter that is known to lie below the floor, dBm."""
        return _expected_below(self(distances), np.maximum(self.deviation, LEAST_DEVIATION), floor)[0]


def decades(distances: Float[np.ndarray, "*shape"]) -> Float[np.ndarray, "*shape"]:
    """−10 log₁₀ of distances in metres, by which the exponent is multiplied."""
    return -10 * np.log10(np.maximum(distances, LEAST_DISTANCE))


def _one(decade: Float[np.ndarray, " n"], power: Float[np.ndarray, " n"], floor: float) -> tuple[float, float, float]:
    """Level, exponent and deviation of one gateway."""
    heard: Bool[np.ndarray, " n"] = ~np.isnan(power)
    if not heard.any():
        return floor - UNHEARD_BELOW, 0.0, 0.0
    level, exponent = _least_squares(decade[heard], power[heard])
    deviation = float(np.std(power[heard] - level - exponent * decade[heard]))
    if heard.all():
        return level, exponent, deviation
    filled, deviation = power.copy(), max(deviation, LEAST_DEVIATION)
    for _ in range(ROUNDS):
        before = level + exponent * decade
        filled[~heard], variance = _expected_below(before[~heard], deviation, floor)
        level, exponent = _least_squares(decade, filled)
        now = level + exponent * decade
        squares = np.square(filled - now)
        squares[~heard] += variance
        deviation = max(float(np.sqrt(squares.mean())), LEAST_DEVIATION)
        if np.abs(now - before).max() < LEAST_CHANGE:
            break
    return level, exponent, deviation


def _least_squares(decade: Float[np.ndarray, " n"], power: Float[np.ndarray, " n"]) -> tuple[float, float]:
    if np.ptp(decade) < 1e-9:
        return float(power.mean() - FREE_SPACE * decade.mean()), FREE_SPACE
    exponent, level = np.polyfit(decade, power, 1)
    return float(level), float(exponent)


def _expected_below(
    mean: Float[np.ndarray, "*shape"], deviation: float | Float[np.ndarray, " G"], floor: float
) -> tuple[Float[np.ndarray, "*shape"], Float[np.ndarray, "*shape"]]:
    """Mean and variance of normal powers, dB, of which is known that they lie below the floor."""
    limit = (floor - mean) / deviation
    ratio = np.exp(-0.5 * limit**2 - 0.5 * np.log(2 * np.pi) - log_ndtr(limit))
    return mean - deviation * ratio, deviation**2 * np.maximum(1 - limit * ratio - ratio**2, 0)


@dataclass(frozen=True)
class KnownPowers:
    """Received powers at n known positions, from which a method learns."""

    positions: Float[np.ndarray, "n 3"]  # transmitter positions, metres, world frame
    powers: Float[np.ndarray, "n G"]  # received powers, dBm; NaN where nothing was received
    gateways: Float[np.ndarray, "G 3"]  # positions of the G gateways, metres, world frame
    floor: float  # power below which a gateway receives nothing, dBm
    wavelength: float  # metres
    seed: int = 0  # seed of everything that is random in a method

    @classmethod
    def of(cls, dataset: Dataset, known: Int[np.ndarray, " n"], seed: int = 0) -> KnownPowers:
        """The powers of a dataset at some of its positions."""
        positions, powers = dataset.positions[known], dataset.powers[known]
        return cls(positions, powers, dataset.gateway_positions, dataset.floor_dbm, dataset.wavelength, seed)

    def distances(self, positions: Float[np.ndarray, "K 3"]) -> Float[np.ndarray, "K G"]:
        """Distance of positions from each gateway, metres."""
        return np.linalg.norm(positions[:, None] - self.gateways, axis=-1)

    @cached_property
    def law(self) -> PathLoss:
        """The log-distance law of each gateway."""
        return PathLoss.fit(self.distances(self.positions), self.powers, self.floor)

    @cached_property
    def filled(self) -> Float[np.ndarray, "n G"]:
        """The powers, dBm. Where nothing was received, what the law expects of a power below the floor."""
        below = self.law.below(self.distances(self.positions), self.floor)
        return np.where(np.isnan(self.powers), below, self.powers)
