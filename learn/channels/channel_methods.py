"""Methods that predict the downlink's channels and take no statistics of them."""

from __future__ import annotations

import numpy as np
from jaxtyping import Complex, Float

from learn.channels.known_channels import KnownChannels, strongest_ramp
from learn.quantities.known import Known
from learn.quantities.quantity import Prediction


class Copy:
    """The uplink as it is."""

    def fit(self, known: Known) -> None:
        pass

    def predict(self, positions: Float[np.ndarray, "K 3"] | None, given: Complex[np.ndarray, "K A S"]) -> Prediction:
        return Prediction(given)


class Ramp(Copy):
    """The uplink of each antenna as one path, whose phase goes on evenly with the frequency."""

    def predict(self, positions: Float[np.ndarray, "K 3"] | None, given: Complex[np.ndarray, "K A S"]) -> Prediction:
        count = given.shape[2]
        step = strongest_ramp(given[:, :, None])[..., None]
        gain = (given * np.exp(-1j * step * np.arange(count))).mean(axis=-1, keepdims=True)
        return Prediction(gain * np.exp(1j * step * np.arange(count, 2 * count)))


class Nearest:
    """The downlink of the known row whose uplink is most alike, with the factor that fits the two uplinks."""

    def fit(self, known: Known) -> None:
        self._up, self._down = np.split(KnownChannels.of(known).alike, 2, axis=2)

    def predict(self, positions: Float[np.ndarray, "K 3"] | None, given: Complex[np.ndarray, "K A S"]) -> Prediction:
        if not len(self._up):
            return Prediction(given)
        known = self._up.reshape(len(self._up), -1)
        level = np.linalg.norm(known, axis=1)
        along = given.reshape(len(given), -1) @ (known / level[:, None]).conj().T
        best = np.abs(along).argmax(axis=1)
        factor = along[np.arange(len(given)), best] / level[best]
        return Prediction(factor[:, None, None] * self._down[best])
