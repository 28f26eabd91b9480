"""Networks without rendering, which predict the spectrum or the element responses from the transmitter's position."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from learn.models.base import SpectrumModel
from learn.models.capabilities import WEAK, PredictsResponses
from learn.models.encoding import EncodingKind, TransmitterEncoding
from learn.models.networks import ResidualFFN
from learn.models.quadrature import Quadrature, interpolation, picture_pixels
from simulate.spectra.beamformer import Beamformer

WIDTH, LAYERS = 256, 4
"""Width and number of residual layers of both networks."""

SAMPLES = 512
"""Largest number of samples of one field that a training step takes, if it has not more places than that."""


class SpectrumMLP(SpectrumModel):
    """A network that predicts the spectrum at a few pixels from the encoded position of the transmitter.

    The pixels are as many as the array can resolve; the whole spectrum is interpolated from them.

    Args:
        region: as for ``SpectrumModel``.
        beamformer: the dataset's array and grid.
        wavelength: metres.
        encoding: encoding of the position, as for ``TransmitterEncoding``.
    """

    rows: Tensor
    columns: Tensor

    def __init__(
        self,
        region: Float[np.ndarray, "2 3"],
        beamformer: Beamformer,
        wavelength: float,
        *,
        encoding: EncodingKind = "octaves",
    ):
        super().__init__(region, wavelength)
        self.encoding = TransmitterEncoding(encoding)
        pixels = picture_pixels(beamformer)
        rows, columns = (torch.from_numpy(matrix).float() for matrix in interpolation(pixels))
        self.register_buffer("rows", rows, persistent=False)
        self.register_buffer("columns", columns, persistent=False)
        self.network = ResidualFFN(self.encoding.size, len(pixels), WIDTH, LAYERS)

    def forward(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B 90 360"]:
        return self._interpolated(positions, self.rows, self.columns)

    def coarse(self, positions: Float[Tensor, "B 3"], pixels: Quadrature) -> Float[Tensor, "B H W"]:
        return self._interpolated(positions, self.rows[pixels.rows], self.columns[pixels.columns])

    def _interpolated(
        self, positions: Float[Tensor, "B 3"], rows: Float[Tensor, "H h"], columns: Float[Tensor, "W w"]
    ) -> Float[Tensor, "B H W"]:
        few = self.network(self.encoded(positions)).sigmoid().unflatten(-1, (rows.shape[1], columns.shape[1]))
        return (rows @ few @ columns.T).clamp(0, 1)


class ResponseMLP(PredictsResponses):
    """A network that predicts the complex element responses from the encoded position of the transmitter.

    If the receiver moves, its elements at all places of the array sample one field, that of the fixed transmitter. The
    network then predicts this field at the elements' own positions, y_m(r) = y(r + d_m), and learns from as many
    samples as there are elements at each place.

    Args:
        region: as for ``SpectrumModel``.
        beamformer: the dataset's array and grid.
        wavelength: metres.
        encoding: encoding of the position, as for ``TransmitterEncoding``.

    Attributes:
        turn: rotation matrix from the gateway frame to the world frame if the receiver moves; otherwise None.
    """

    elements: Tensor
    turn: Tensor | None

    def __init__(
        self,
        region: Float[np.ndarray, "2 3"],
        beamformer: Beamformer,
        wavelength: float,
        *,
        encoding: EncodingKind = "octaves",
    ):
        super().__init__(region, beamformer, wavelength)
        self.register_buffer("turn", None)
        self.register_buffer("elements", torch.from_numpy(beamformer.array.positions).float(), persistent=False)
        self.encoding = TransmitterEncoding(encoding)
        self.network = ResidualFFN(self.encoding.size, 2 * beamformer.array.elements, WIDTH, LAYERS)

    def sample_one_field(self, turn: Float[Tensor, "3 3"]) -> None:
        """As for ``SamplesOneField``."""
        self.turn = turn.to(self.region)
        self.network = ResidualFFN(self.encoding.size, 2, WIDTH, LAYERS).to(self.region)

    def responses(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B elements 2"]:
        """Element responses (real, imaginary); their scale and common phase are arbitrary."""
        if self.turn is not None:
            return self._field(positions, self.elements)
        return self.network(self.encoded(positions)).unflatten(-1, (-1, 2))

    def responses_loss(
        self, positions: Float[Tensor, "B 3"], responses: Float[Tensor, "B elements 2"]
    ) -> Float[Tensor, ""]:
        """As for ``PredictsResponses``; of one field, that of some elements, drawn at random, to save time."""
        if self.turn is None:
            return super().responses_loss(positions, responses)
        count = max(1, min(len(self.elements), SAMPLES // len(positions)))
        drawn = torch.randperm(len(self.elements), device=positions.device)[:count]
        error = (self._field(positions, self.elements[drawn]) - responses[:, drawn]).square().sum(dim=-1).mean(dim=-1)
        return (error / (responses.square().sum(dim=-1).mean(dim=-1) + WEAK)).mean()

    def _field(self, positions: Float[Tensor, "B 3"], elements: Float[Tensor, "some 3"]) -> Float[Tensor, "B some 2"]:
        """The field at elements (wavelengths, gateway frame) of arrays at positions."""
        assert self.turn is not None
        places = (positions[:, None] + self.wavelength * elements @ self.turn.T).flatten(0, 1)
        return self.network(self.encoded(places)).unflatten(0, (-1, len(elements)))

    def load_state_dict(self, state_dict: Mapping[str, Any], strict: bool = True, assign: bool = False) -> Any:
        """As ``torch.nn.Module.load_state_dict``, also with the weights of one field."""
        if "turn" in state_dict and self.turn is None:
            self.sample_one_field(state_dict["turn"])
        return super().load_state_dict(state_dict, strict, assign)
