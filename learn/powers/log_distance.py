"""Methods for received powers that follow a law of distance alone."""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import Float

from learn.models.kriging.deviation_curve import NORMAL
from learn.quantities.known import Known
from learn.quantities.known_powers import KnownPowers, PathLoss
from learn.quantities.quantity import Prediction


class LogDistance:
    """The log-distance law of each gateway, P = P₀ − 10 n log₁₀ d. Its deviation gives the interval."""

    def fit(self, known: Known) -> None:
        self._known = KnownPowers.of(known.dataset, known.rows)
        self._law = self._fitted(self._known)

    def predict(self, positions: Float[np.ndarray, "K 3"], given: Any = None) -> Prediction:
        value, half = self._law(self._known.distances(positions)), NORMAL * self._law.deviation
        return Prediction(value, value - half, value + half)

    def _fitted(self, known: KnownPowers) -> PathLoss:
        return known.law


class Mri(LogDistance):
    """One log-distance law for all gateways, as NeRF²'s published program has it for its baseline MRI [shin2015]."""

    def _fitted(self, known: KnownPowers) -> PathLoss:
        return PathLoss.shared(known.distances(known.positions), known.powers, known.floor)
