"""Received powers (RSSI) as evidence of places: a survey predicts the powers at any point, with intervals."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from jaxtyping import Bool, Float
from scipy.special import log_ndtr, logsumexp, ndtri

from learn.localisation.evidence import Evidence
from learn.quantities.quantity import Prediction
from scenes.files.plain_text import say
from scenes.scene.shapes import bounding_box
from simulate.spectra.spectrum import evenly

END = float(ndtri(0.95))  # Ends of the 90 % interval of a normal distribution, standard deviations

LEAST_DEVIATION = 0.5
"""Least standard deviation of a predicted power, dB. Gateways report powers in steps of about 1 dB."""

LEVELS = np.arange(-20.0, 21.0)  # Levels that are tried where none is stated, dB

LEVEL_SPREAD = 6.0  # Standard deviation of the level of a device before anything is heard, dB

LEAST_GAIN = 2.0
"""Least gain in the logarithm of the probability for which a level other than 0 is taken."""

LEVEL_ROWS, LEVEL_POINTS = 50, 2000  # Largest numbers of transmitters and points by which the level is estimated


class PowerEvidence(Evidence):
    """Powers of one device at K places, by what a survey predicts.

    The density about the predicted median is the split normal one: deviations below and above it are those of the two
    ends of the 90 % interval, since fading is skewed. A power that was not received is one below the floor. The errors
    of different gateways are independent.
    """

    most = 2000  # with four times as many, places in an office were no nearer

    def __init__(
        self,
        predict: Callable[[Float[np.ndarray, "n 3"]], Prediction],
        heard: Float[np.ndarray, "K G"],
        positions: Float[np.ndarray, "n 3"],
        powers: Float[np.ndarray, "n G"],
        floor: float,
        wavelength: float,
    ):
        super().__init__(heard, bounding_box(positions), wavelength, positions)
        self._predict, self._powers, self._floor = predict, powers, floor
        self.level = 0.0
        """How much stronger the device is than that of the survey, dB."""

    @property
    def told(self) -> Bool[np.ndarray, " K"]:
        """Transmitters that a gateway received."""
        return ~np.isnan(self.heard).all(axis=1)

    def log_likelihood(
        self, points: Float[np.ndarray, "n 3"], heard: Float[np.ndarray, "k G"]
    ) -> Iterator[Float[np.ndarray, " n"]]:
        """By the powers that are predicted at the points."""
        predicted = self._intervals(points)
        for row in heard:
            yield self._likely(predicted, row, self.level)

    def misfit(self, points: Float[np.ndarray, "n 3"], row: Float[np.ndarray, " G"]) -> Float[np.ndarray, " n"]:
        """Mean square of the received powers' errors, in stated standard deviations."""
        median, below, above = self._intervals(points)
        over = row - self.level - median
        return np.nanmean(np.square(over / np.where(over > 0, above, below)), axis=1)

    def unlike(self) -> Float[np.ndarray, "K n"]:
        """Distance of the powers in dB, with the floor for what was not received."""
        seen, there = (np.where(np.isnan(each), self._floor, each) for each in (self.heard - self.level, self._powers))
        return np.linalg.norm(seen[:, None] - there, axis=2)

    def estimate_level(self) -> None:
        """Take the most probable level of a device that sent at K unknown places, if it is clearly more than 0."""
        low, high = self.region
        points = np.random.default_rng(0).uniform(low, high, (LEVEL_POINTS, 3))
        chosen, predicted = evenly(self.heard[self.told], LEVEL_ROWS), self._intervals(points)
        gains = np.array([sum(logsumexp(self._likely(predicted, row, each)) for row in chosen) for each in LEVELS])
        gains -= np.square(LEVELS / LEVEL_SPREAD) / 2
        best = int(gains.argmax())
        self.level = float(LEVELS[best]) if gains[best] - gains[LEVELS == 0][0] > LEAST_GAIN else 0.0
        than = (
            f"{abs(self.level):g} dB {'stronger' if self.level > 0 else 'weaker'} than"
            if self.level
            else "as strong as"
        )
        say(f"took all heard powers for those of one device, {than} that of the survey")

    def _intervals(self, points: Float[np.ndarray, "n 3"]) -> tuple[Float[np.ndarray, "n G"], ...]:
        """Predicted medians, and the deviations below and above them, dB."""
        predicted = self._predict(points)
        assert predicted.low is not None and predicted.high is not None
        median = predicted.value
        ends = (median - predicted.low, predicted.high - median)
        return median, *(np.maximum(each / END, LEAST_DEVIATION) for each in ends)

    def _likely(
        self, predicted: tuple[Float[np.ndarray, "n G"], ...], powers: Float[np.ndarray, " G"], level: float
    ) -> Float[np.ndarray, " n"]:
        median, below, above = predicted
        over = powers - level - median
        seen = -np.square(over / np.where(over > 0, above, below)) / 2 - np.log(below + above)
        # The logarithm of the probability that a power is below the floor.
        over = self._floor - level - median
        share = 2 / (below + above)
        more = share * above * np.exp(log_ndtr(-np.maximum(over, 0) / above))
        less = np.log(share * below) + log_ndtr(np.minimum(over, 0) / below)
        return np.where(np.isnan(powers), np.where(over > 0, np.log1p(-more), less), seen).sum(axis=1)
