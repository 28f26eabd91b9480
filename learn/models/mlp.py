"""Networks without rendering, which predict the spectrum or the element responses from the transmitter's position."""

from __future__ import annotations

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor, nn

from learn.models.base import BeamformingLayer, SpectrumModel
from learn.models.encoding import TX_ORDER, positional_encoding
from learn.models.networks import ResidualFFN
from learn.models.quadrature import Quadrature
from simulate.angular_grid import COLUMNS, ROWS
from simulate.beamformer import Beamformer

WIDTH, LAYERS = 256, 4


class SpectrumMLP(SpectrumModel):
    """Predicts each pixel of the spectrum, 0…1, from the transmitter's position (TX-PE).

    Args:
        region: as for ``SpectrumModel``.
        beamformer: the dataset's array and grid; this model does not use them.
        order: number of octaves of TX-PE.
    """

    def __init__(self, region: Float[np.ndarray, "2 3"], beamformer: Beamformer, order: int = TX_ORDER):
        super().__init__(region)
        self.order = order
        self.network = ResidualFFN(3 * (2 * order + 1), ROWS * COLUMNS, WIDTH, LAYERS)

    def forward(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B 90 360"]:
        pixels = self.network(positional_encoding(self.scaled(positions), self.order)).sigmoid()
        return pixels.unflatten(-1, (ROWS, COLUMNS))

    def coarse(self, positions: Float[Tensor, "B 3"], pixels: Quadrature) -> Float[Tensor, "B H W"]:
        features = self.network.features(positional_encoding(self.scaled(positions), self.order))
        chosen = torch.from_numpy(COLUMNS * pixels.rows[:, None] + pixels.columns).to(positions.device)
        last = self.network.outward
        return (
            nn.functional.linear(features, last.weight[chosen.flatten()], last.bias[chosen.flatten()])
            .sigmoid()
            .unflatten(-1, chosen.shape)
        )


class ResponseMLP(SpectrumModel):
    """Predicts the complex element responses from the transmitter's position (TX-PE), and the spectrum from these.

    Args:
        region: as for ``SpectrumModel``.
        beamformer: the dataset's array and grid.
        order: number of octaves of TX-PE.
    """

    def __init__(self, region: Float[np.ndarray, "2 3"], beamformer: Beamformer, order: int = TX_ORDER):
        super().__init__(region)
        self.order = order
        self.network = ResidualFFN(3 * (2 * order + 1), 2 * beamformer.array.elements, WIDTH, LAYERS)
        self.beamforming = BeamformingLayer(beamformer)

    @property
    def has_responses(self) -> bool:
        return True

    def responses(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B elements 2"]:
        """Element responses (real, imaginary); their scale and common phase are arbitrary."""
        return self.network(positional_encoding(self.scaled(positions), self.order)).unflatten(-1, (-1, 2))

    def forward(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B 90 360"]:
        return self.beamforming(self.responses(positions))
