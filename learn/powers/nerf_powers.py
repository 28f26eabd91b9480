"""NeRF² [zhao2023] for received powers, written from its published program's settings; torch is imported when it fits.

The documentation, Other authors' models, says where it differs from that program.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from jaxtyping import Float

from learn.quantities.known import Known
from learn.quantities.known_powers import KnownPowers
from learn.quantities.quantity import Prediction

if TYPE_CHECKING:
    from torch import Tensor

    from learn.models.peers.nerf2 import RaySize

MOST_STEPS, BATCH = 30_000, 128
"""Of the published program. A batch counts pairs of a position and a gateway."""

ZERO_DBM = -100.0
"""Power that is an amplitude of 0; an amplitude of 1 is 0 dBm, and between them amplitudes are linear in dB."""

LEAST_UNIT = 1.0  # Metres; rays are at least so long

AT_ONCE = 64  # Positions that are predicted at once


class NerfPowers:
    """The magnitude of the sum of all rays of a gateway gives the power, linear in dB: P = −100 dBm + 100 dB |h|.

    It learns from the powers that were received, by the mean squared error of |h|. If a position was received nowhere,
    it teaches nothing, and the prediction is never below −100 dBm.
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

        from learn.models.peers.nerf2 import (
            PUBLISHED,
            REDUCED_BATCH,
            RaySignals,
            octaves,
            published_adam,
            size_here,
        )
        from learn.training.fit_progress import train_steps

        known = KnownPowers.of(taught.dataset, taught.rows, taught.seed)
        device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
        every = np.concatenate([known.positions, known.gateways])
        self._centre = (every.min(axis=0) + every.max(axis=0)) / 2
        self._unit = max(float(np.ptp(every, axis=0).max()), LEAST_UNIT)
        heard = ~np.isnan(known.powers)
        powers = known.powers if heard.any() else known.filled
        chosen = np.flatnonzero(heard.any(axis=1)) if heard.any() else np.arange(len(powers))
        truth = torch.from_numpy((powers[chosen] - ZERO_DBM) / -ZERO_DBM).float().to(device)
        mask = ~truth.isnan()
        truth = truth.nan_to_num()
        with torch.random.fork_rng():
            torch.manual_seed(known.seed)
            size = self._size or size_here()
            inputs = octaves(torch.zeros(1, 3)).shape[1]
            receivers = known.gateways - self._centre
            self.network = RaySignals(receivers, inputs, self._unit, self._unit, known.wavelength, size).to(device)
            places = self._encoded(known.positions[chosen])
            each = min(len(places), max(1, (BATCH if size == PUBLISHED else REDUCED_BATCH) // len(known.gateways)))

            def loss() -> Tensor:
                drawn = torch.randperm(len(places))[:each].to(device)
                error = self._amplitudes(places[drawn]) - truth[drawn]
                return error[mask[drawn]].square().mean()

            most, minutes = taught.limits(self._steps, MOST_STEPS)
            self.steps = train_steps(loss, published_adam(self.network), title="nerf2", most=most, minutes=minutes)

    def predict(self, positions: Float[np.ndarray, "K 3"], given: Any = None) -> Prediction:
        import torch

        with torch.no_grad():
            parts = [self._amplitudes(each) for each in self._encoded(positions).split(AT_ONCE)]
        amplitude = torch.cat(parts).double().cpu().numpy()
        return Prediction(ZERO_DBM - ZERO_DBM * amplitude)

    def _encoded(self, positions: Float[np.ndarray, "K 3"]) -> Float[Tensor, "K inputs"]:
        import torch

        from learn.models.peers.nerf2 import octaves

        scaled = torch.from_numpy((positions - self._centre) / self._unit).float()
        return octaves(scaled).to(next(self.network.parameters()).device)

    def _amplitudes(self, places: Float[Tensor, "B inputs"]) -> Float[Tensor, "B G"]:
        """``|h|`` of each gateway."""
        signals = self.network(places[:, None])[:, :, 0]
        return signals.square().sum(-1).clamp_min(1e-20).sqrt()
