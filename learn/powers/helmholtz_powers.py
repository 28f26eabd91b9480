"""The method helmholtz for received powers, and universal kriging about powers that a model of the waves predicts."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.special import ndtri

from learn.data.neighbours import inverse_distance
from learn.powers.power_covariance import FADING_DB, JITTER, fit_covariance
from learn.quantities.known import Known
from learn.quantities.known_powers import KnownPowers, decades
from learn.quantities.quantity import Prediction
from scenes.files.plain_text import say

MOST_KNOWN = 5000
"""Largest number of known positions; of more, so many are drawn. The factorisation takes the cube of the number."""

QUANTILES = (0.05, 0.5, 0.95)
"""Of the predicted distribution: ends of the 90 % interval, and the median."""

LEAST_ERRORS = 20
"""Fewer left-out errors tell no quantiles; then those of the normal distribution are taken."""

SHARES = (0.0, 0.25, 0.5, 0.75, 1.0)  # Shares of inverse-distance weighting that are tried

LEAST_GAIN = 0.01  # A smaller gain in the mean left-out error, as a share of it, can be due to chance


class HelmholtzPowers:
    """Universal kriging in dB: the law of each gateway is estimated together with what it leaves.

    Fading in dB is skewed, with deep fades, and a Gaussian process is not. So the errors at known positions that are
    left out one by one, in stated standard deviations, give the median and the interval. By the same errors,
    inverse-distance weighting gets a share of the prediction where it predicts better [wolpert1992].
    """

    NAME: ClassVar[str] = "helmholtz"
    TAKEN_BY: ClassVar[Literal["linear", "weibull"]] = "linear"  # how NumPy takes quantiles of the errors

    def fit(self, known: Known) -> None:
        self._learn(KnownPowers.of(known.dataset, known.rows, known.seed))

    def _learn(self, known: KnownPowers) -> None:
        chosen = _at_most(len(known.positions), known.seed)
        if len(chosen) < len(known.positions):
            say(f"{self.NAME} learns from {len(chosen)} of the {len(known.positions)} known positions")
        self._known, self._chosen = known, chosen
        self._positions, self._powers = known.positions[chosen], known.filled[chosen]
        trends = self._known_trends()
        left = self._left(trends)
        self.covariance = fit_covariance(self._positions, left, known.wavelength, known.seed)
        whole = self.covariance(self._positions, self._positions)
        whole[np.diag_indices_from(whole)] += self.covariance.shares[2] + JITTER
        self._inverse = np.linalg.inv(whole)
        columns = zip(trends, self._powers.T, strict=True)
        self._gateways = [_Gateway(self._inverse, *each) for each in columns]
        self._stack(~np.isnan(known.powers[chosen]))

    def _trends(self, positions: Float[np.ndarray, "K 3"]) -> list[Float[np.ndarray, "K T"]]:
        """What the mean power of each gateway is linear in: here the law's level and its exponent."""
        decade = decades(self._known.distances(positions))
        return [np.stack([np.ones_like(column), column], axis=1) for column in decade.T]

    def _known_trends(self) -> list[Float[np.ndarray, "n T"]]:
        """The same at the known positions."""
        return self._trends(self._positions)

    def _left(self, trends: list[Float[np.ndarray, "n T"]]) -> Float[np.ndarray, "n G"]:
        """What the trends leave of the known powers, dB: here by the law that also fits what was not received."""
        return self._powers - self._known.law(self._known.distances(self._positions))

    def _stack(self, heard: Bool[np.ndarray, "n G"]) -> None:
        """Choose the share of inverse-distance weighting, and the quantiles of the left-out errors."""
        errors = np.stack([each.left_out_error for each in self._gateways], axis=1)
        deviations = np.stack([each.left_out_deviation for each in self._gateways], axis=1)
        others = self._powers - inverse_distance(self._positions, self._powers, self._positions, leave_out=True)
        mixed = {share: ((1 - share) * errors + share * others)[heard] for share in SHARES}
        size = {share: float(np.abs(each).mean()) if each.size else 0.0 for share, each in mixed.items()}
        self.share = min(SHARES, key=lambda share: size[share])
        if size[self.share] > (1 - LEAST_GAIN) * size[0.0]:
            self.share = 0.0
        stated = mixed[self.share] / np.maximum(deviations[heard], JITTER)
        self._quantiles = self._spread(stated)

    def _spread(self, stated: Float[np.ndarray, " errors"]) -> Float[np.ndarray, " 3"]:
        """``QUANTILES`` of left-out errors in stated standard deviations."""
        if stated.size < LEAST_ERRORS:
            return ndtri(QUANTILES)
        return np.quantile(stated, QUANTILES, method=self.TAKEN_BY)

    def predict(self, positions: Float[np.ndarray, "K 3"], given: Any = None) -> Prediction:
        near = self.covariance(positions, self._positions)
        explained = np.einsum("kn,kn->k", near @ self._inverse, near)
        trends = self._trends(positions)
        each = [gateway.predict(near, explained, trend) for gateway, trend in zip(self._gateways, trends, strict=True)]
        mean, deviation = (np.stack(values, axis=1) for values in zip(*each, strict=True))
        if self.share:
            others = inverse_distance(self._positions, self._powers, positions)
            mean = (1 - self.share) * mean + self.share * others
        low, median, high = (mean + quantile * deviation for quantile in self._quantiles)
        return Prediction(median, low, high)


class _Gateway:
    """Universal kriging of the powers of one gateway about a linear trend."""

    def __init__(
        self, inverse: Float[np.ndarray, "n n"], trend: Float[np.ndarray, "n T"], power: Float[np.ndarray, " n"]
    ):
        self._weighted_trend = inverse @ trend
        self._uncertainty = np.linalg.pinv(trend.T @ self._weighted_trend)
        self._law = self._uncertainty @ self._weighted_trend.T @ power
        self._weights = inverse @ (power - trend @ self._law)
        # Leaving out a known power needs no new fit [dubrule1983].
        explained = np.einsum("nt,tu,nu->n", self._weighted_trend, self._uncertainty, self._weighted_trend)
        precision = np.maximum(np.diag(inverse) - explained, JITTER)
        free = len(power) - trend.shape[1]
        squares = max(float((power - trend @ self._law) @ self._weights), 0.0)
        self._deviation = np.sqrt(squares / free) if free > 0 else FADING_DB  # two powers tell none
        self.left_out_error = self._weights / precision
        self.left_out_deviation = self._deviation / np.sqrt(precision)

    def predict(
        self, near: Float[np.ndarray, "K n"], explained: Float[np.ndarray, " K"], trend: Float[np.ndarray, "K T"]
    ) -> tuple[Float[np.ndarray, " K"], Float[np.ndarray, " K"]]:
        """Mean and standard deviation, dBm and dB; ``explained`` is the variance that the known powers explain."""
        mean = trend @ self._law + near @ self._weights
        open_trend = trend - near @ self._weighted_trend
        of_law = np.einsum("kt,tu,ku->k", open_trend, self._uncertainty, open_trend)
        return mean, self._deviation * np.sqrt(np.maximum(1 - explained + of_law, 0))


def _at_most(count: int, seed: int) -> Int[np.ndarray, " n"]:
    """The known positions that are used: all, or ``MOST_KNOWN`` that are drawn."""
    if count <= MOST_KNOWN:
        return np.arange(count)
    return np.sort(np.random.default_rng(seed).permutation(count)[:MOST_KNOWN])


class ExplainedPowers(HelmholtzPowers):
    """The mean power of a gateway is P = a + n D + b T, with D = −10 log₁₀ of the distance and an explained power T.

    The weights a, n and b of each gateway are estimated with the remainder, so that what explains nothing gets no
    weight, and ``helmholtz`` is left. Subclasses set ``_of_known``, T at the known positions [n, G], before ``_learn``.
    """

    _of_known: Float[np.ndarray, "n G"]

    def _explained(self, positions: Float[np.ndarray, "K 3"]) -> Float[np.ndarray, "K G"]:
        """T of each gateway, dB."""
        raise NotImplementedError

    def _trends(self, positions: Float[np.ndarray, "K 3"]) -> list[Float[np.ndarray, "K 3"]]:
        return self._with(self._explained(positions), super()._trends(positions))

    def _known_trends(self) -> list[Float[np.ndarray, "n 3"]]:
        return self._with(self._of_known[self._chosen], super()._trends(self._positions))

    def _with(
        self, explained: Float[np.ndarray, "K G"], law: list[Float[np.ndarray, "K 2"]]
    ) -> list[Float[np.ndarray, "K 3"]]:
        return [np.column_stack(each) for each in zip(law, explained.T, strict=True)]

    def _left(self, trends: list[Float[np.ndarray, "n 3"]]) -> Float[np.ndarray, "n G"]:
        pairs = zip(trends, self._powers.T, strict=True)
        return self._powers - np.stack([trend @ np.linalg.lstsq(trend, power)[0] for trend, power in pairs], axis=1)
