"""The idea of SwiftWRF: planar Gaussians that the transmitter's position deforms, added up without depth.

Written from the idea in plain torch, not from the authors' code; docs/peers.md says what differs.
"""

from __future__ import annotations

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor, nn

from learn.models.base import SpectrumModel
from learn.models.encoding import PRIMITIVE_ORDER, TX_ORDER, positional_encoding
from learn.models.networks import ResidualFFN
from learn.models.splat import splat
from simulate.angular_grid import AZIMUTHS_DEG, ELEVATIONS_DEG
from simulate.array import PlanarArray

WIDTH, LAYERS = 128, 4

FAINT = 1e-9
"""So small an opacity that Π (1 − FAINT) is 1 and alpha blending becomes addition."""

MOVED_DEG = 30.0
"""Largest distance that the deformation moves a Gaussian, degrees."""


class SwiftWRF(SpectrumModel):
    """S(φ, θ) = Σ_i c_i G_i(φ, θ); centre, scales, rotation and colour c_i are deformed by a network of (i, position).

    Args:
        region: as ``SpectrumModel``.
        array: the gateway's array; this model does not use it.
        primitives: number of Gaussians.
    """

    azimuths: Tensor
    elevations: Tensor

    def __init__(self, region: Float[np.ndarray, "2 3"], array: PlanarArray, primitives: int = 500):
        super().__init__(region)
        self.register_buffer("azimuths", torch.tensor(AZIMUTHS_DEG).float(), persistent=False)
        self.register_buffer("elevations", torch.tensor(ELEVATIONS_DEG).float(), persistent=False)
        self.centre = nn.Parameter(torch.rand(primitives, 2) * torch.tensor([360.0, 90.0]))
        self.scale_raw = nn.Parameter((4 + 8 * torch.rand(primitives, 2)).log())
        self.rotation = nn.Parameter(torch.pi * torch.rand(primitives))
        self.colour = nn.Parameter(0.1 * torch.rand(primitives))
        inputs = 2 * (2 * PRIMITIVE_ORDER + 1) + 3 * (2 * TX_ORDER + 1)
        self.deformation = ResidualFFN(inputs, 6, WIDTH, LAYERS)

    def forward(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B 90 360"]:
        where = self.centre / self.centre.new_tensor([180.0, 45.0]) - 1
        encodings = (
            positional_encoding(where, PRIMITIVE_ORDER)[None],
            positional_encoding(self.scaled(positions), TX_ORDER)[:, None],
        )
        moved, grown, turned, brightened = self.deformation(*encodings).split([2, 2, 1, 1], dim=-1)
        centre = self.centre + MOVED_DEG * moved.tanh()
        scale = (self.scale_raw + grown.tanh()).exp().clamp(0.5, 60.0)
        rotation = self.rotation + turned[..., 0]
        colour = (self.colour + brightened[..., 0]) / FAINT
        coefficient = torch.stack([colour, torch.zeros_like(colour)], dim=-1)
        opacity = torch.full_like(rotation, FAINT)
        none = torch.zeros_like(self.rotation)  # no depth
        fields = [
            splat(
                centre[one, :, 0].remainder(360),
                centre[one, :, 1],
                none,
                scale[[one]],
                rotation[[one]],
                opacity[[one]],
                coefficient[[one]],
                self.azimuths,
                self.elevations,
            )
            for one in range(len(positions))  # the renderer shares centres among spectra; here each has its own
        ]
        return torch.cat(fields)[..., 0]
