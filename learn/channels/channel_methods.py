"""The methods that predict the downlink's channels, by name, and those that take no statistics of the channels."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from jaxtyping import Complex, Float

from learn.channels.known_channels import ChannelMethod, KnownChannels, PredictedChannels, strongest_ramp
from learn.channels.linear_channels import Delays, HelmholtzChannels, HelmholtzPositions
from learn.channels.nerf_channels import NerfChannels


class Copy:
    """The uplink as it is."""

    def fit(self, known: KnownChannels) -> None:
        pass

    def predict(
        self, uplink: Complex[np.ndarray, "K A S"], positions: Float[np.ndarray, "K 3"] | None = None
    ) -> PredictedChannels:
        return PredictedChannels(uplink)


class Ramp(Copy):
    """The uplink of each antenna as one path, whose phase goes on evenly with the frequency."""

    def predict(
        self, uplink: Complex[np.ndarray, "K A S"], positions: Float[np.ndarray, "K 3"] | None = None
    ) -> PredictedChannels:
        count = uplink.shape[2]
        step = strongest_ramp(uplink[:, :, None])[..., None]
        gain = (uplink * np.exp(-1j * step * np.arange(count))).mean(axis=-1, keepdims=True)
        return PredictedChannels(gain * np.exp(1j * step * np.arange(count, 2 * count)))


class Nearest:
    """The downlink of the known row whose uplink is most alike, with the factor that fits the two uplinks."""

    def fit(self, known: KnownChannels) -> None:
        self._up, self._down = np.split(known.alike, 2, axis=2)

    def predict(
        self, uplink: Complex[np.ndarray, "K A S"], positions: Float[np.ndarray, "K 3"] | None = None
    ) -> PredictedChannels:
        if not len(self._up):
            return PredictedChannels(uplink)
        known = self._up.reshape(len(self._up), -1)
        level = np.linalg.norm(known, axis=1)
        along = uplink.reshape(len(uplink), -1) @ (known / level[:, None]).conj().T
        best = np.abs(along).argmax(axis=1)
        factor = along[np.arange(len(uplink)), best] / level[best]
        return PredictedChannels(factor[:, None, None] * self._down[best])


CHANNEL_METHODS: dict[str, Callable[[], ChannelMethod]] = {
    "copy": Copy,
    "ramp": Ramp,
    "nearest": Nearest,
    "delays": Delays,
    "helmholtz": HelmholtzChannels,
    "nerf2": NerfChannels,
    "helmholtz-positions": HelmholtzPositions,
}
"""Functions that make new, unfitted methods."""

BASELINES = ("copy", "ramp", "nearest")  # Methods that the report of another one shows beside it
