"""What a method learns from, what it predicts, and the interface of a method."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from jaxtyping import Float, Int

from learn.powers.path_loss import PathLoss
from simulate.rssi.rssi_dataset import RssiDataset


@dataclass(frozen=True)
class KnownPowers:
    """Received powers at n known positions, from which a method learns.

    Attributes:
        positions: transmitter positions, metres, world frame.
        powers: received powers, dBm; NaN where nothing was received.
        gateways: positions of the G gateways, metres, world frame.
        floor: power below which a gateway receives nothing, dBm.
        wavelength: metres.
        seed: seed of everything that is random in a method.
        minutes: training time of a method that is trained by steps.
    """

    positions: Float[np.ndarray, "n 3"]
    powers: Float[np.ndarray, "n G"]
    gateways: Float[np.ndarray, "G 3"]
    floor: float
    wavelength: float
    seed: int = 0
    minutes: float = 5.0

    @classmethod
    def of(cls, dataset: RssiDataset, known: Int[np.ndarray, " n"], seed: int = 0, minutes: float = 5.0) -> KnownPowers:
        """The powers of a dataset at some of its positions.

        Args:
            dataset: received powers.
            known: indices of the known positions.
            seed: seed of everything that is random in a method.
            minutes: training time of a method that is trained by steps.
        """
        positions, powers = dataset.positions[known], dataset.rssi_dbm[known]
        return cls(positions, powers, dataset.gateway_positions, dataset.floor_dbm, dataset.wavelength, seed, minutes)

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


@dataclass(frozen=True)
class PredictedPowers:
    """Powers that a method predicts at K positions, dBm. One below the floor predicts that nothing is received.

    Attributes:
        median: the predicted powers: the median, if the method predicts a distribution.
        low, high: ends of the interval that holds the power with a probability of 90 %. None: the method states none.
    """

    median: Float[np.ndarray, "K G"]
    low: Float[np.ndarray, "K G"] | None = None
    high: Float[np.ndarray, "K G"] | None = None


class PowerMethod(Protocol):
    """A method that learns from known powers and predicts others."""

    def fit(self, known: KnownPowers) -> None:
        """Learn from known powers."""

    def predict(self, positions: Float[np.ndarray, "K 3"]) -> PredictedPowers:
        """Predict powers at transmitter positions in metres, world frame."""
