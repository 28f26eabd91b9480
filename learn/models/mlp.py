"""Networks without rendering, which predict the spectrum or the element responses from the transmitter's position."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from torch import Tensor

from learn.models.base import BeamformingLayer, SpectrumModel
from learn.models.encoding import EncodingKind, TransmitterEncoding
from learn.models.networks import ResidualFFN
from simulate.angular_grid import COLUMNS, ROWS
from simulate.beamformer import Beamformer

WIDTH, LAYERS = 256, 4


class SpectrumMLP(SpectrumModel):
    """Predicts each pixel of the spectrum, 0…1, from the encoded position of the transmitter.

    Args:
        region: as for ``SpectrumModel``.
        beamformer: the dataset's array and grid; this model does not use them.
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
        super().__init__(region, wavelength)
        self.encoding = TransmitterEncoding(encoding)
        self.network = ResidualFFN(self.encoding.size, ROWS * COLUMNS, WIDTH, LAYERS)

    def forward(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B 90 360"]:
        pixels = self.network(self.encoded(positions)).sigmoid()
        return pixels.unflatten(-1, (ROWS, COLUMNS))

    @property
    def trains_on_few_pixels(self) -> bool:
        return False  # each pixel has weights of its own, which only its own error trains


class ResponseMLP(SpectrumModel):
    """Predicts the complex element responses from the encoded position of the transmitter, and the spectrum from these.

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
        super().__init__(region, wavelength)
        self.encoding = TransmitterEncoding(encoding)
        self.network = ResidualFFN(self.encoding.size, 2 * beamformer.array.elements, WIDTH, LAYERS)
        self.beamforming = BeamformingLayer(beamformer)

    @property
    def has_responses(self) -> bool:
        return True

    def responses(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B elements 2"]:
        """Element responses (real, imaginary); their scale and common phase are arbitrary."""
        return self.network(self.encoded(positions)).unflatten(-1, (-1, 2))

    def forward(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B 90 360"]:
        return self.beamforming(self.responses(positions))
