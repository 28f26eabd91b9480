"""Networks without rendering, which predict the spectrum or the element responses from the transmitter's position."""

from __future__ import annotations

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from learn.models.base import SpectrumModel
from learn.models.capabilities import PredictsResponses
from learn.models.encoding import EncodingKind, TransmitterEncoding
from learn.models.networks import ResidualFFN
from learn.models.quadrature import Quadrature, interpolation, picture_pixels
from simulate.spectra.beamformer import Beamformer

WIDTH, LAYERS = 256, 4
"""Width and number of residual layers of both networks."""


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

    Args:
        region: as for ``SpectrumModel``.
        beamformer: the dataset's array and grid.
        wavelength: metres.
        encoding: encoding of the position, as for ``TransmitterEncoding``.
    """

    def __init__(
        self,
        region: Float[np.ndarray, "2 3"],
        beamformer: Beamformer,
        wavelength: float,
        *,
        encoding: EncodingKind = "octaves",
    ):
        super().__init__(region, beamformer, wavelength)
        self.encoding = TransmitterEncoding(encoding)
        self.network = ResidualFFN(self.encoding.size, 2 * beamformer.array.elements, WIDTH, LAYERS)

    def responses(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B elements 2"]:
        """Element responses (real, imaginary); their scale and common phase are arbitrary."""
        return self.network(self.encoded(positions)).unflatten(-1, (-1, 2))
