"""The paper's models BiSplat-WRF and BiSplat-WRF+ [zhang2026].

Symbols are the paper's: N_p primitives, N_c clusters, φ azimuth, θ elevation, ρ in-plane rotation, c_i complex
coefficient. What the paper leaves open, and what was chosen, is in the documentation, The models.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, get_args

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor, nn

from learn.models.base import SplatModel, power
from learn.models.encoding import PRIMITIVE_ORDER, EncodingKind, TransmitterEncoding, positional_encoding
from learn.models.networks.bst import BilinearSpatialTransformer
from learn.models.networks.feed_forward import ResidualFFN
from learn.models.networks.primitives import SCALE_LEAST, SCALE_MOST, Primitives
from learn.models.quadrature import Quadrature
from learn.models.splatting.splat import Splats, splat
from scenes.files.errors import ParameterError, shown
from simulate.spectra.beamformer import Beamformer

Bypass = Literal["dynamic", "delta", "bst", "order"]
"""Branches that can be switched off: three from the paper's ablation table, and "order", the ordering by depth."""

W_SCALE_COARSE, W_SCALE_FINE = 0.5, 1.0
"""w_scale of the hierarchy-based mixing: smaller for coarse primitives, to keep the background stable."""


class BiSplatWRF(SplatModel):
    """The paper's model. The defaults are those of BiSplat-WRF; the registry has those of BiSplat-WRF+."""

    def __init__(
        self,
        region: Float[np.ndarray, "2 3"],
        beamformer: Beamformer,
        wavelength: float,
        *,
        primitives: int = 500,
        clusters: int = 64,
        ffn_width: int = 128,
        ffn_layers: int = 4,
        transformer_layers: int = 3,
        transformer_heads: int = 4,
        transformer_ffn_width: int = 256,
        encoding: EncodingKind = "octaves",
        bypass: Sequence[Bypass] = (),
    ):
        super().__init__(region, beamformer, wavelength)
        unknown = sorted(set(bypass) - set(get_args(Bypass)))
        if unknown:
            raise ParameterError("bypass", f"expected some of {', '.join(get_args(Bypass))}, found {shown(unknown[0])}")
        self.bypass = frozenset(bypass)
        self.encoding = TransmitterEncoding(encoding)
        gs_pe, tx_pe = 3 * (2 * PRIMITIVE_ORDER + 1), self.encoding.size
        self.primitives = Primitives(primitives)
        self.static = ResidualFFN(gs_pe, 2, ffn_width, ffn_layers)
        self.bst = BilinearSpatialTransformer(
            gs_pe + tx_pe,
            ffn_width,
            clusters,
            transformer_layers,
            transformer_heads,
            transformer_ffn_width,
            bypass="bst" in bypass,
        )
        self.dynamic = ResidualFFN(ffn_width, 2, ffn_width, ffn_layers)
        self.delta = ResidualFFN(gs_pe + tx_pe + ffn_width, 4, ffn_width, ffn_layers)

    def undecayed(self) -> list[nn.Parameter]:
        return list(self.primitives.parameters())

    def splats(self, positions: Float[Tensor, "B 3"]) -> Splats:
        """The primitives as they are blended for each transmitter position."""
        primitives = self.primitives
        azimuth, elevation = primitives.azimuth, primitives.elevation
        gs_pe = positional_encoding(primitives.coordinates, PRIMITIVE_ORDER)
        tx_pe = self.encoded(positions)
        encodings = gs_pe[None], tx_pe[:, None]  # 1 N_p 51 and, in octaves, B 1 39
        features = self.bst(azimuth, elevation, *encodings)

        # Hierarchy-based mixing: c_i = (amp_static + w_scale amp_mod) e^{j(phase_static + phase_mod)}
        amplitude, phase = self.static(gs_pe).unbind(-1)
        if "dynamic" not in self.bypass:
            amplitude_mod, phase_mod = self.dynamic(features).unbind(-1)
            w_scale = torch.where(primitives.coarse, W_SCALE_COARSE, W_SCALE_FINE)
            amplitude = amplitude + w_scale * amplitude_mod
            phase = phase + phase_mod
        coefficient = torch.stack([amplitude * phase.cos(), amplitude * phase.sin()], dim=-1)

        # Offsets are added to the unconstrained parameters, so that scales stay positive and opacities stay in (0, 1).
        offset = positions.new_zeros(positions.shape[0], len(azimuth), 4)
        if "delta" not in self.bypass:
            offset = self.delta(*encodings, features)
        rotation = primitives.rotation + offset[..., 0]
        # The scale is bounded, since a primitive that shrinks to zero gets no gradient any more.
        scale = (primitives.scale_raw + offset[..., 1:3].tanh()).exp().clamp(SCALE_LEAST, SCALE_MOST)
        opacity = (primitives.opacity_raw + offset[..., 3]).sigmoid()

        depth = torch.zeros_like(primitives.depth) if "order" in self.bypass else primitives.depth
        coefficient = coefficient.expand(positions.shape[0], -1, -1)
        return Splats(azimuth, elevation, depth, scale, rotation, opacity, coefficient)

    def field(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B H W 2"]:
        """The complex field F(φ, θ) of each transmitter position on this model's grid (real, imaginary)."""
        return splat(*self.splats(positions), self.azimuths, self.elevations)

    def forward(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B 90 360"]:
        """Predicted spectrum: ``SPS = |F|²`` at every pixel, which is fitted directly to the normalised spectra."""
        return power(self.field(positions))

    def coarse(self, positions: Float[Tensor, "B 3"], pixels: Quadrature) -> Float[Tensor, "B H W"]:
        azimuths, elevations = self.azimuths[pixels.columns], self.elevations[pixels.rows]
        return power(splat(*self.splats(positions), azimuths, elevations))
