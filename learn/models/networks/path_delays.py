"""Responses over a band as gains of a few learned delays, the same gains at all subcarriers."""

from __future__ import annotations

import numpy as np
import torch
from jaxtyping import Complex, Float
from torch import Tensor, nn

HELD = 0.9
"""Share of the known power within the delays that a training begins with."""


class PathDelays(nn.Module):
    """y(f) = Σ_p c_p e^(−i 2π (f − f₀) τ_p): a path of delay τ_p has one gain c_p at all subcarriers.

    At the carrier f₀, subcarrier ⌊N/2⌋ of N, the response is the sum of the gains. Within a region small against
    c / bandwidth, a path's own change of delay is a sum of neighbouring ones.

    >>> delays = PathDelays(4, np.array([0.25]))
    >>> gain = torch.tensor([[0.0, 3.0]])  # 3i
    >>> [[round(part, 3) + 0.0 for part in pair] for pair in delays(gain).tolist()]
    [[0.0, -3.0], [-3.0, 0.0], [0.0, 3.0], [3.0, 0.0]]
    """

    turns: Tensor  # phase at each subcarrier of a path with delay −1, radians

    def __init__(self, subcarriers: int, first: Float[np.ndarray, " paths"]):
        super().__init__()
        turns = 2 * torch.pi * (torch.arange(subcarriers) - subcarriers // 2)
        self.register_buffer("turns", turns.float())
        self.delays = nn.Parameter(torch.from_numpy(first).float())

    def factors(self) -> Float[Tensor, "paths subcarriers 2"]:
        """e^(−i 2π (f − f₀) τ_p) (real, imaginary)."""
        phase = -self.delays[:, None] * self.turns
        return torch.stack([phase.cos(), phase.sin()], dim=-1)

    def forward(self, gains: Float[Tensor, "*batch paths 2"]) -> Float[Tensor, "*batch subcarriers 2"]:
        """Responses (real, imaginary) at all subcarriers, of the gains of all paths."""
        (real, imaginary), (cos, sin) = gains.unbind(-1), self.factors().unbind(-1)
        return torch.stack([real @ cos - imaginary @ sin, real @ sin + imaginary @ cos], dim=-1)


def first_delays(responses: Complex[np.ndarray, "n elements subcarriers"], count: int) -> Float[np.ndarray, " count"]:
    """Evenly spaced delays over those that hold most of the power, in units of 1 / distance of the subcarriers."""
    profile = np.square(np.abs(np.fft.ifft(responses, axis=-1))).sum(axis=(0, 1))
    bins = len(profile)
    order = np.argsort(profile)[::-1]
    held = np.cumsum(profile[order]) <= HELD * profile.sum()
    within = order[: int(held.sum()) + 1]
    signed = np.where(within > 0.75 * bins, within - bins, within)  # just before 0: a path between two delays
    return np.linspace(signed.min() - 0.5, signed.max() + 0.5, count) / bins
