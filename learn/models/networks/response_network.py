"""Base class of networks that learn element responses: also those of receivers that move, and those over a band."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from jaxtyping import Complex, Float
from torch import Tensor, nn

from learn.models.capabilities import PredictsResponses, relative_error
from learn.models.networks.path_delays import PathDelays, first_delays
from simulate.spectra.beamformer import Beamformer


class ResponseNetwork(PredictsResponses):
    """Predicts responses at the carrier, or as gains of learned delays over a band."""

    # rotation matrix from the gateway frame to the world frame if the receiver moves; otherwise None
    turn: Tensor | None
    band: PathDelays | None  # the delays, if the network learns responses over a band; otherwise None

    def __init__(self, region: Float[np.ndarray, "2 3"], beamformer: Beamformer, wavelength: float):
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

    def sample_one_field(self, turn: Float[Tensor, "3 3"]) -> None:
        """As for ``SamplesOneField``."""
        self.turn = turn.to(self.region)
        self.rebuild()

    def learn_band(self, responses: Complex[np.ndarray, "n elements subcarriers"]) -> None:
        """As for ``LearnsBand``."""
        first = first_delays(responses, self.paths)
        self._learn_delays(PathDelays(responses.shape[2], first[torch.randperm(self.paths).numpy()]))

    def _learn_delays(self, band: PathDelays) -> None:
        self.band = band.to(self.region.device)
        self.rebuild()

    def band_responses(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B elements subcarriers 2"] | None:
        """As for ``PredictsBand``."""
        return None if self.band is None else self.over_band(self.band, positions)

    def responses_loss(
        self, positions: Float[Tensor, "B 3"], responses: Float[Tensor, "B elements *subcarriers 2"]
    ) -> Float[Tensor, ""]:
        """As for ``PredictsResponses``; of a network that learns a band, for responses at all subcarriers."""
        if self.band is None:
            return super().responses_loss(positions, responses)
        return relative_error(self.over_band(self.band, positions), responses)

    def load_state_dict(self, state_dict: Mapping[str, Any], strict: bool = True, assign: bool = False) -> Any:
        """As ``torch.nn.Module.load_state_dict``, also with the weights of one field or of a band."""
        if "turn" in state_dict and self.turn is None:
            self.sample_one_field(state_dict["turn"])
        if "band.delays" in state_dict and self.band is None:
            delays, turns = state_dict["band.delays"], state_dict["band.turns"]
            self._learn_delays(PathDelays(len(turns), np.zeros(len(delays))))
        return super().load_state_dict(state_dict, strict, assign)
