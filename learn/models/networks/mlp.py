"""Networks without rendering, which predict the spectrum or the element responses from the transmitter's position."""

from __future__ import annotations

import torch
from jaxtyping import Float
from torch import Tensor

from learn.models.base import Region, SpectrumModel
from learn.models.capabilities import relative_error
from learn.models.encoding import TransmitterEncoding
from learn.models.networks.feed_forward import ResidualFFN
from learn.models.networks.response_network import PathDelays, ResponseNetwork
from learn.models.quadrature import Quadrature, interpolation, picture_pixels
from simulate.spectra.beamformer import Beamformer

WIDTH, LAYERS = 256, 4  # width and number of residual layers of both networks
PATHS = 8  # number of delays over a band
SAMPLES = 512  # largest number of samples of one field that a training step takes, if it has not more places than that


class SpectrumMLP(SpectrumModel):
    """A network from the encoded position to as many pixels as the array can resolve; the others are interpolated."""

    rows: Tensor
    columns: Tensor

    def __init__(self, region: Region, beamformer: Beamformer, wavelength: float):
        super().__init__(region, wavelength)
        self.encoding = TransmitterEncoding("octaves")
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
        few = (
            self.network(self.encoding(positions, self.region, self.wavelength))
            .sigmoid()
            .unflatten(-1, (rows.shape[1], columns.shape[1]))
        )
        return (rows @ few @ columns.T).clamp(0, 1)


class ResponseMLP(ResponseNetwork):
    """A network from the position, as plane waves, to the complex element responses.

    Over a band, it predicts the gains of ``PATHS`` learned delays at each element.

    If the receiver moves, it predicts the field of the fixed transmitter at the elements' own places, y(r + d_m).
    """

    elements: Tensor
    paths = PATHS

    def __init__(self, region: Region, beamformer: Beamformer, wavelength: float):
        super().__init__(region, beamformer, wavelength)
        self.register_buffer("elements", torch.from_numpy(beamformer.array.positions).float(), persistent=False)
        self.encoding = TransmitterEncoding("waves")
        self.rebuild()

    def rebuild(self) -> None:
        elements = len(self.elements) if self.turn is None else 1
        gains = 1 if self.band is None else self.paths
        self.network = ResidualFFN(self.encoding.size, 2 * elements * gains, WIDTH, LAYERS).to(self.region)

    def responses(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B elements 2"]:
        return self._gains(positions, self.elements).sum(dim=-2)

    def over_band(self, band: PathDelays, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B elements subcarriers 2"]:
        return band(self._gains(positions, self.elements))

    def responses_loss(
        self, positions: Float[Tensor, "B 3"], responses: Float[Tensor, "B elements *subcarriers 2"]
    ) -> Float[Tensor, ""]:
        """As for ``PredictsResponses``; of one field, that of some elements, drawn at random, to save time."""
        if self.turn is None:
            return super().responses_loss(positions, responses)
        count = max(1, min(len(self.elements), SAMPLES // len(positions)))
        drawn = torch.randperm(len(self.elements), device=positions.device)[:count]
        gains = self._gains(positions, self.elements[drawn])
        return relative_error(gains.sum(dim=-2) if self.band is None else self.band(gains), responses[:, drawn])

    def _gains(
        self, positions: Float[Tensor, "B 3"], elements: Float[Tensor, "some 3"]
    ) -> Float[Tensor, "B some gains 2"]:
        """Gains of all delays; their sum is the response at the carrier, which is the only gain if there is no band."""
        if self.turn is None:
            return self.network(self.encoding(positions, self.region, self.wavelength)).unflatten(
                -1, (len(elements), -1, 2)
            )
        places = (positions[:, None] + self.wavelength * elements @ self.turn.T).flatten(0, 1)
        return (
            self.network(self.encoding(places, self.region, self.wavelength))
            .unflatten(0, (-1, len(elements)))
            .unflatten(-1, (-1, 2))
        )
