"""The method mlp-responses over a band: a network of the position predicts the gain of a few delays at each element."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np
from jaxtyping import Complex, Float

from learn.band.known_band import KnownBand, PredictedBand
from scenes.scene.description import SPEED_OF_LIGHT

if TYPE_CHECKING:
    from torch import Tensor

MOST_STEPS, BATCH, LEARNING_RATE, WEIGHT_DECAY = 3000, 128, 1e-3, 1.0
"""Those of the model mlp-responses."""

PATHS = 8
"""Number of delays."""

WIDTH, LAYERS = 256, 4
"""Of the network."""

HELD = 0.9
"""Share of the known power within the delays that the training begins with."""

WEAK = 0.1
"""Power below which a position counts less, relative to the mean power."""


class DelayNetwork:
    """y_m(f) = Σ_p c_pm(r) e^(−i 2π (f − f₀) τ_p): a path of delay τ_p has one gain at all subcarriers.

    A network predicts the gains from the position, encoded as plane waves at the carrier; the delays are learned, too.
    Within a region small against c / bandwidth, a path's own change of delay is a sum of neighbouring ones.

    Args:
        steps: number of training steps. None: as many as fit into ``KnownBand.minutes``, at most ``MOST_STEPS``.

    Attributes:
        delays: the learned delays, seconds.
        found: the delays in words.
    """

    by_steps: ClassVar[bool] = True
    """It is trained for minutes, so a comparison has it only if it is named."""

    delays: Float[np.ndarray, " paths"]
    found: str

    def __init__(self, steps: int | None = None):
        self._steps = steps

    def fit(self, known: KnownBand) -> None:
        import torch
        from torch import nn

        from learn.models.encoding import TransmitterEncoding
        from learn.models.networks import ResidualFFN
        from learn.training.timed_steps import train_steps

        responses, frequencies = known.responses, known.frequencies
        middle = float(frequencies.mean())
        self._scale = float(np.sqrt(np.square(np.abs(responses)).mean())) or 1.0
        self._offsets = frequencies - middle
        self._device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
        low, high = known.positions.min(axis=0), known.positions.max(axis=0)
        self._region = torch.from_numpy(np.stack([low, high])).float().to(self._device)
        self._wavelength = torch.tensor(SPEED_OF_LIGHT / middle)
        unit = 1 / (frequencies[1] - frequencies[0]) if len(frequencies) > 1 else 1e-9  # the delay of one whole turn
        self._turns = torch.from_numpy(2 * np.pi * self._offsets * unit).float().to(self._device)
        pairs = torch.view_as_real(torch.from_numpy((responses / self._scale).astype(np.complex64))).to(self._device)
        with torch.random.fork_rng():
            torch.manual_seed(known.seed)
            self._encoding = TransmitterEncoding("waves").to(self._device)
            elements = responses.shape[1]
            self._network = ResidualFFN(self._encoding.size, 2 * PATHS * elements, WIDTH, LAYERS).to(self._device)
            first = torch.from_numpy(first_delays(responses)).float().to(self._device)
            self._delays = nn.Parameter(first)
            places = self._encoded(known.positions)

            def loss() -> Tensor:
                drawn = torch.randperm(len(places))[:BATCH].to(self._device)
                error = (self._responses(places[drawn]) - pairs[drawn]).square().sum(-1).mean((1, 2))
                return (error / (pairs[drawn].square().sum(-1).mean((1, 2)) + WEAK)).mean()

            groups = [
                {"params": [*self._network.parameters()], "weight_decay": WEIGHT_DECAY},
                {"params": [self._delays], "weight_decay": 0.0},
            ]
            most = MOST_STEPS if self._steps is None else self._steps
            minutes = known.minutes if self._steps is None else None
            optimiser = torch.optim.AdamW(groups, lr=LEARNING_RATE)
            self.steps = train_steps(loss, optimiser, title="mlp-responses", most=most, minutes=minutes)
        self.delays = np.sort(self._delays.detach().double().cpu().numpy()) * unit
        self.found = f"{PATHS} delays from {1e9 * self.delays[0]:.0f} to {1e9 * self.delays[-1]:.0f} ns"

    def predict(self, positions: Float[np.ndarray, "K 3"]) -> PredictedBand:
        import torch

        with torch.no_grad():
            found = torch.cat([self._responses(each) for each in self._encoded(positions).split(BATCH)])
        return PredictedBand(self._scale * torch.view_as_complex(found.double().cpu().contiguous()).numpy())

    def _encoded(self, positions: Float[np.ndarray, "K 3"]) -> Float[Tensor, "K size"]:
        import torch

        places = torch.from_numpy(positions).float().to(self._device)
        return self._encoding(places, self._region, self._wavelength.to(self._device))

    def _responses(self, places: Float[Tensor, "B size"]) -> Float[Tensor, "B elements subcarriers 2"]:
        """Responses (real, imaginary), scaled to a mean square magnitude of 1."""
        import torch

        real, imaginary = self._network(places).unflatten(-1, (-1, PATHS, 2)).unbind(-1)
        phase = -self._delays[:, None] * self._turns
        cos, sin = phase.cos(), phase.sin()
        return torch.stack([real @ cos - imaginary @ sin, real @ sin + imaginary @ cos], dim=-1)


def first_delays(responses: Complex[np.ndarray, "n elements subcarriers"]) -> Float[np.ndarray, " paths"]:
    """Evenly spaced delays over those that hold most of the power, in units of 1 / distance of the subcarriers.

    Args:
        responses: responses at evenly spaced subcarriers.
    """
    profile = np.square(np.abs(np.fft.ifft(responses, axis=-1))).sum(axis=(0, 1))
    count = len(profile)
    order = np.argsort(profile)[::-1]
    held = np.cumsum(profile[order]) <= HELD * profile.sum()
    bins = order[: int(held.sum()) + 1]
    signed = np.where(bins > 0.75 * count, bins - count, bins)  # just before 0: a path between two delays
    return np.linspace(signed.min() - 0.5, signed.max() + 0.5, PATHS) / count
