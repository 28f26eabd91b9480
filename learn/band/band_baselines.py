"""Methods without waves: the nearest known responses, and a weighted mean of the four nearest."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from scipy.spatial import cKDTree

from learn.band.known_band import KnownBand, PredictedBand
from learn.baselines.neighbours import NEIGHBOURS


class Nearest:
    """The responses of the nearest known position."""

    neighbours = 1

    def fit(self, known: KnownBand) -> None:
        self._places, self._responses = cKDTree(known.positions), known.responses

    def predict(self, positions: Float[np.ndarray, "K 3"]) -> PredictedBand:
        distance, index = self._places.query(positions, k=min(self.neighbours, self._places.n))
        weight = 1 / np.maximum(distance.reshape(len(positions), -1), 1e-9)
        weight /= weight.sum(axis=1, keepdims=True)
        near = self._responses[index.reshape(weight.shape)]
        return PredictedBand(np.einsum("kn,knas->kas", weight, near))


class InverseDistance(Nearest):
    """The mean of the responses of the four nearest known positions, weighted by 1 / distance."""

    neighbours = NEIGHBOURS
