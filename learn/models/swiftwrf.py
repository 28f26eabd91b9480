"""The idea of SwiftWRF [liu2025]: planar Gaussians, summed without depth order, that a network deforms by position.

It is written in plain torch from the idea, not from the authors' code; differences are in the documentation, Other
authors' models.
"""

from __future__ import annotations

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor, nn

from learn.models.base import SpectrumModel
from learn.models.encoding import PRIMITIVE_ORDER, EncodingKind, TransmitterEncoding, positional_encoding
from learn.models.networks import ResidualFFN
from learn.models.quadrature import Quadrature
from learn.models.splat import splat
from simulate.spectra.beamformer import Beamformer

WIDTH, LAYERS = 128, 4
"""Width and number of residual layers of the deformation network."""

FAINT = 1e-9
"""Opacity of every Gaussian, so small that Π (1 − FAINT) is 1 and alpha blending becomes addition."""

MOVED_DEG = 30.0
"""Largest distance that the deformation moves a Gaussian along each axis, degrees."""


class SwiftWRF(SpectrumModel):
    """The idea of SwiftWRF [liu2025]: a sum of deformed Gaussians, ``S(φ, θ) = Σ_i c_i G_i(φ, θ)``.

    The coefficients ("colours") c_i are real. A network deforms centre, scales, rotation and colour of each Gaussian,
    given its centre and the transmitter's position.

    Args:
        region: as for ``SpectrumModel``.
        beamformer: the dataset's array, which this model does not use, and grid.
        wavelength: metres.
        primitives: number of Gaussians.
        encoding: encoding of the transmitter's position, as for ``TransmitterEncoding``.
    """

    azimuths: Tensor
    elevations: Tensor

    def __init__(
        self,
        region: Float[np.ndarray, "2 3"],
        beamformer: Beamformer,
        wavelength: float,
        *,
        primitives: int = 500,
        encoding: EncodingKind = "octaves",
    ):
        super().__init__(region, wavelength)
        self.encoding = TransmitterEncoding(encoding)
        self.register_buffer("azimuths", torch.tensor(beamformer.grid.azimuths_deg).float(), persistent=False)
        self.register_buffer("elevations", torch.tensor(beamformer.grid.elevations_deg).float(), persistent=False)
        # In radians: Adam's steps would hardly move values in degrees.
        self.centre_radians = nn.Parameter(torch.rand(primitives, 2) * torch.tensor([2 * torch.pi, torch.pi / 2]))
        self.scale_raw = nn.Parameter((4 + 8 * torch.rand(primitives, 2)).log())
        self.rotation = nn.Parameter(torch.pi * torch.rand(primitives))
        self.colour = nn.Parameter(0.1 * torch.rand(primitives))
        inputs = 2 * (2 * PRIMITIVE_ORDER + 1) + self.encoding.size
        self.deformation = ResidualFFN(inputs, 6, WIDTH, LAYERS)

    def undecayed(self) -> list[nn.Parameter]:
        return [self.centre_radians, self.scale_raw, self.rotation, self.colour]

    def forward(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B 90 360"]:
        """Predicted spectrum: the sum of the deformed Gaussians."""
        return self._spectra(positions, self.azimuths, self.elevations)

    def coarse(self, positions: Float[Tensor, "B 3"], pixels: Quadrature) -> Float[Tensor, "B H W"]:
        return self._spectra(positions, self.azimuths[pixels.columns], self.elevations[pixels.rows])

    def _spectra(
        self, positions: Float[Tensor, "B 3"], azimuths: Float[Tensor, " W"], elevations: Float[Tensor, " H"]
    ) -> Float[Tensor, "B H W"]:
        undeformed = self.centre_radians.rad2deg()
        scaled_centre = undeformed / undeformed.new_tensor([180.0, 45.0]) - 1
        encodings = (
            positional_encoding(scaled_centre, PRIMITIVE_ORDER)[None],
            self.encoded(positions)[:, None],
        )
        d_centre, d_scale, d_rotation, d_colour = self.deformation(*encodings).split([2, 2, 1, 1], dim=-1)
        centre = undeformed + MOVED_DEG * d_centre.tanh()
        scale = (self.scale_raw + d_scale.tanh()).exp().clamp(0.5, 60.0)
        rotation = self.rotation + d_rotation[..., 0]
        colour = (self.colour + d_colour[..., 0]) / FAINT
        coefficient = torch.stack([colour, torch.zeros_like(colour)], dim=-1)
        opacity = torch.full_like(rotation, FAINT)
        depth = torch.zeros_like(self.rotation)  # equal depths: the order has no effect on a sum
        # One call per spectrum, since the renderer assumes that all spectra of a batch have the same centres.
        fields = [
            splat(
                centre[sample, :, 0].remainder(360),
                centre[sample, :, 1],
                depth,
                scale[[sample]],
                rotation[[sample]],
                opacity[[sample]],
                coefficient[[sample]],
                azimuths,
                elevations,
            )
            for sample in range(len(positions))
        ]
        return torch.cat(fields)[..., 0]
