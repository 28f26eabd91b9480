"""Base class of networks that learn element responses: also those of receivers that move, and those over a band."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from jaxtyping import Complex, Float, Int
from scipy.spatial.transform import Rotation
from torch import Tensor, nn

from learn.models.base import Region, part_of
from learn.models.capabilities import PredictsResponses, relative_error
from simulate.dataset.dataset import Dataset
from simulate.spectra.beamformer import Beamformer

HELD = 0.9  # share of the known power within the delays that a training begins with


class PathDelays(nn.Module):
    """y(f) = Σ_p c_p e^(−i 2π (f − f₀) τ_p): a path of delay τ_p has one gain c_p at all subcarriers.

    At the carrier f₀, subcarrier ⌊N/2⌋ of N, the response is the sum of the gains. Within a region small against
    c / bandwidth, a path's own change of delay is a sum of neighbouring ones.
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


class ResponseNetwork(PredictsResponses):
    """Predicts responses at the carrier, or as gains of learned delays over a band."""

    # rotation matrix from the gateway frame to the world frame if the receiver moves; otherwise None
    turn: Tensor | None
    band: PathDelays | None  # the delays, if the network learns responses over a band; otherwise None

    def __init__(self, region: Region, beamformer: Beamformer, wavelength: float):
        super().__init__(region, beamformer, wavelength)
        self.register_buffer("turn", None)
        self.band = None

    @property
    @abstractmethod
    def paths(self) -> int:
        """Number of delays over a band."""

    @abstractmethod
    def over_band(self, band: PathDelays, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B elements subcarriers 2"]:
        """Responses (real, imaginary) with these delays at positions, metres, world frame."""

    def rebuild(self) -> None:
        """Build what depends on ``turn`` and ``band`` anew, if anything does."""

    def undecayed(self) -> list[nn.Parameter]:
        return [] if self.band is None else [self.band.delays]

    def adapt_to(self, dataset: Dataset, known: Int[np.ndarray, " n"]) -> None:
        """Learn the one field that a moving array samples, y_m(r) = y(r + d_m), and all subcarriers of a band."""
        if dataset.moving == "receiver":
            turn = Rotation.from_quat(dataset.gateway_orientation).as_matrix()
            self.sample_one_field(torch.from_numpy(turn).float())
        if dataset.band is not None:
            self.learn_band(dataset.band_responses[known])

    def sample_one_field(self, turn: Float[Tensor, "3 3"]) -> None:
        self.turn = turn.to(self.region)
        self.rebuild()

    def learn_band(self, responses: Complex[np.ndarray, "n elements subcarriers"]) -> None:
        first = first_delays(responses, self.paths)
        self._learn_delays(PathDelays(responses.shape[2], first[torch.randperm(self.paths).numpy()]))

    def _learn_delays(self, band: PathDelays) -> None:
        self.band = band.to(self.region.device)
        self.rebuild()

    def band_responses(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B elements subcarriers 2"] | None:
        return None if self.band is None else self.over_band(self.band, positions)

    def responses_loss(
        self, positions: Float[Tensor, "B 3"], responses: Float[Tensor, "B elements *subcarriers 2"]
    ) -> Float[Tensor, ""]:
        if self.band is None:
            return super().responses_loss(positions, responses)
        return relative_error(self.over_band(self.band, positions), responses)

    def _load_from_state_dict(self, state_dict: Mapping[str, Tensor], prefix: str, *others: Any) -> None:
        """As for ``torch.nn.Module``, also with the weights of one field or of a band."""
        numbers = part_of(state_dict, prefix)
        if "turn" in numbers and self.turn is None:
            self.sample_one_field(numbers["turn"])
        if "band.delays" in numbers and self.band is None:
            self._learn_delays(PathDelays(len(numbers["band.turns"]), np.zeros(len(numbers["band.delays"]))))
        super()._load_from_state_dict(state_dict, prefix, *others)
