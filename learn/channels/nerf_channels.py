"""NeRF² [zhao2023] for channels, written from its published program's settings; torch is imported when it fits.

The documentation, Other authors' models, says where it differs from that program.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np
from jaxtyping import Complex, Float

from learn.channels.known_channels import KnownChannels
from learn.quantities.known import Known
from learn.quantities.quantity import Prediction

if TYPE_CHECKING:
    from torch import Tensor

    from learn.models.peers.nerf2 import RaySize

MOST_STEPS, BATCH = 70_000, 64
"""Of the published program. A batch counts pairs of a row and an antenna."""

FAR = 5.0  # Length of a ray, metres

AT_ONCE = 32  # Rows that are predicted at once


class NerfChannels:
    """The sum of all rays of an antenna is its downlink; each subcarrier has attenuations and signals of its own.

    The uplink of the antenna, as real and imaginary parts, takes the place of the transmitter's position. Channels are
    divided by the largest known one, and the loss is the mean squared error.
    """

    by_steps: ClassVar[bool] = True
    """It is trained for minutes, so ``compare`` has it only if it is named."""

    def __init__(self, steps: int | None = None, size: RaySize | None = None):
        self._steps, self._size = steps, size

    @property
    def reduced(self) -> bool:
        """Whether it is smaller than published, because there is no GPU."""
        from learn.models.peers.nerf2 import PUBLISHED, size_here

        return (self._size or size_here()) != PUBLISHED

    def fit(self, taught: Known) -> None:
        import torch

        from learn.models.peers.nerf2 import PUBLISHED, REDUCED_BATCH, RaySignals, published_adam, size_here
        from learn.training.fit_progress import train_steps

        known = KnownChannels.of(taught)
        self._device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
        largest = max(float(np.abs(link).max(initial=0)) for link in (known.uplink, known.downlink))
        self._level = largest if largest > 0 else 1.0
        antennas, count = known.uplink.shape[1:]
        receivers = np.zeros((antennas, 3)) if known.antennas is None else known.antennas
        uplink, downlink = self._pairs(known.uplink).flatten(-2), self._pairs(known.downlink)
        with torch.random.fork_rng():
            torch.manual_seed(known.seed)
            size = self._size or size_here()
            signals = RaySignals(receivers, 2 * count, FAR, 1.0, known.wavelength, size, count)
            self.network = signals.to(self._device)
            each = min(len(uplink), max(1, (BATCH if size == PUBLISHED else REDUCED_BATCH) // antennas))

            def loss() -> Tensor:
                drawn = torch.randperm(len(uplink))[:each].to(self._device)
                return (self.network(uplink[drawn]) - downlink[drawn]).square().mean()

            most, minutes = taught.limits(self._steps, MOST_STEPS)
            self.steps = train_steps(loss, published_adam(self.network), title="nerf2", most=most, minutes=minutes)

    def predict(self, positions: Float[np.ndarray, "K 3"] | None, given: Complex[np.ndarray, "K A S"]) -> Prediction:
        import torch

        with torch.no_grad():
            parts = [self.network(each) for each in self._pairs(given).flatten(-2).split(AT_ONCE)]
        return Prediction(self._level * torch.view_as_complex(torch.cat(parts).double().cpu()).numpy())

    def _pairs(self, links: Complex[np.ndarray, "K A S"]) -> Float[Tensor, "K A S 2"]:
        """Links in units of the largest known channel, as real and imaginary parts."""
        import torch

        pairs = np.stack([links.real, links.imag], axis=-1) / self._level
        return torch.from_numpy(pairs).float().to(self._device)
