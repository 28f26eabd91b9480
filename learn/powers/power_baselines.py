"""Methods for received powers that take no model of fading: neighbours, laws of distance, and kriging.

All of them take the expected power below the floor where nothing was received (``KnownPowers.filled``).
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from scipy.spatial import cKDTree
from scipy.special import ndtri

from learn.baselines.kriging import Interpolator
from learn.baselines.neighbours import NEIGHBOURS, nearest
from learn.powers.known_powers import KnownPowers, PathLoss, PredictedPowers

NINETY = float(ndtri(0.95))
"""Half the width of the interval that holds 90 % of a normal distribution, in standard deviations."""


class Mean:
    """The mean of the known powers of each gateway, dB."""

    known: KnownPowers

    def fit(self, known: KnownPowers) -> None:
        self.known = known

    def predict(self, positions: Float[np.ndarray, "K 3"]) -> PredictedPowers:
        filled = self.known.filled
        return PredictedPowers(np.broadcast_to(filled.mean(axis=0), (len(positions), filled.shape[1])))


class Nearest(Mean):
    """The powers at the nearest known position."""

    def predict(self, positions: Float[np.ndarray, "K 3"]) -> PredictedPowers:
        return PredictedPowers(nearest(self.known.positions, self.known.filled, positions))


class InverseDistance(Mean):
    """The mean in dB of the powers at the four nearest known positions, weighted by 1 / distance."""

    def predict(self, positions: Float[np.ndarray, "K 3"]) -> PredictedPowers:
        return PredictedPowers(by_inverse_distance(self.known.positions, self.known.filled, positions))


class LogDistance(Mean):
    """The log-distance law of each gateway. Its deviation gives the interval."""

    def predict(self, positions: Float[np.ndarray, "K 3"]) -> PredictedPowers:
        law = self._law()
        median = law(self.known.distances(positions))
        return PredictedPowers(median, median - NINETY * law.deviation, median + NINETY * law.deviation)

    def _law(self) -> PathLoss:
        return self.known.law


class Mri(LogDistance):
    """One log-distance law for all gateways, as NeRF²'s published program has it for its baseline MRI [shin2015]."""

    def _law(self) -> PathLoss:
        known = self.known
        return PathLoss.shared(known.distances(known.positions), known.powers, known.floor)


class Kriging(Mean):
    """Kriging in dB of what the log-distance law leaves, with one squared-exponential kernel for all gateways."""

    def fit(self, known: KnownPowers) -> None:
        self.known = known
        left = known.filled - known.law(known.distances(known.positions))
        self._interpolator = Interpolator(known.positions, left, known.seed)

    def predict(self, positions: Float[np.ndarray, "K 3"]) -> PredictedPowers:
        mean, deviation = self._interpolator.with_deviation(positions)
        median = self.known.law(self.known.distances(positions)) + mean
        return PredictedPowers(median, median - NINETY * deviation, median + NINETY * deviation)


def by_inverse_distance(
    known: Float[np.ndarray, "n 3"],
    powers: Float[np.ndarray, "n G"],
    positions: Float[np.ndarray, "K 3"],
    leave_out: bool = False,
) -> Float[np.ndarray, "K G"]:
    """Mean of the powers at the four nearest known positions, weighted by 1 / distance."""
    count = min(NEIGHBOURS + leave_out, len(known))
    distance, index = cKDTree(known).query(positions, k=range(1, count + 1))
    distance = np.maximum(distance, 1e-9)
    if leave_out:
        distance[index == np.arange(len(known))[:, None]] = np.inf
        distance[np.isinf(distance).all(axis=1)] = 1  # a single known position
    weight = 1 / distance
    weight /= weight.sum(axis=1, keepdims=True)
    return np.einsum("kn,kng->kg", weight, powers[index])
