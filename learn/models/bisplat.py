"""The paper's models BiSplat-WRF and BiSplat-WRF+, and our BiSplat-aperture.

Symbols are the paper's: N_p primitives, N_c clusters, φ azimuth, θ elevation, ρ in-plane rotation, c_i complex
coefficient. docs/model.md lists what the paper leaves open and what was chosen.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal, get_args

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from learn.models.base import BeamformingLayer, SpectrumModel, on_pairs, power
from learn.models.bst import BilinearSpatialTransformer
from learn.models.encoding import PRIMITIVE_ORDER, TX_ORDER, positional_encoding
from learn.models.networks import ResidualFFN
from learn.models.primitives import Primitives
from learn.models.quadrature import Quadrature
from learn.models.splat import Splats, splat
from scenes.errors import ParameterError
from simulate.beamformer import Beamformer

Bypass = Literal["dynamic", "delta", "bst", "order"]
"""Branches that can be switched off: those of the paper's ablation table, and "order", the ordering by depth."""

W_SCALE_COARSE, W_SCALE_FINE = 0.5, 1.0
"""w_scale of the hierarchy-based mixing: smaller for coarse primitives, to keep the background stable."""

SCALE_LEAST, SCALE_MOST = 0.5, 60.0
"""Bounds of a primitive's standard deviation, degrees: half a pixel, and a sixth of a turn."""


class BiSplatWRF(SpectrumModel):
    """The paper's model. The defaults are those of BiSplat-WRF; the registry has those of BiSplat-WRF+.

    Args:
        region: corners (min, max) of the box of training positions, metres, world frame; it is scaled to −1…1 before
            TX-PE.
        beamformer: the dataset's array, which this model does not use, and grid.
        primitives: number of primitives N_p.
        clusters: number of clusters N_c, a square number.
        ffn_width: width of the static network, the dynamic network and the delta decoder.
        ffn_layers: number of residual layers of each of them.
        transformer_layers: number of encoder layers of the BST.
        transformer_heads: number of attention heads of the BST.
        transformer_ffn_width: width of the feed-forward networks inside the BST's encoder layers.
        tx_order: number of octaves L of TX-PE.
        bypass: branches whose output is replaced: by zero for "dynamic" and "delta", by the BST's linear projection for
            "bst"; "order" blends the primitives in stored order instead of by depth.

    Raises:
        ParameterError: ``bypass`` names an unknown branch.
    """

    azimuths: Tensor
    elevations: Tensor

    def __init__(
        self,
        region: Float[np.ndarray, "2 3"],
        beamformer: Beamformer,
        *,
        primitives: int = 500,
        clusters: int = 64,
        ffn_width: int = 128,
        ffn_layers: int = 4,
        transformer_layers: int = 3,
        transformer_heads: int = 4,
        transformer_ffn_width: int = 256,
        tx_order: int = TX_ORDER,
        bypass: Sequence[Bypass] = (),
    ):
        super().__init__(region)
        unknown = sorted(set(bypass) - set(get_args(Bypass)))
        if unknown:
            raise ParameterError("bypass", f"expected some of {', '.join(get_args(Bypass))}, found {unknown[0]}")
        self.bypass, self.tx_order = frozenset(bypass), tx_order
        azimuths, elevations = self._grid(beamformer)
        self.register_buffer("azimuths", azimuths, persistent=False)
        self.register_buffer("elevations", elevations, persistent=False)
        gs_pe, tx_pe = 3 * (2 * PRIMITIVE_ORDER + 1), 3 * (2 * tx_order + 1)
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

    def _grid(self, beamformer: Beamformer) -> tuple[Float[Tensor, " W"], Float[Tensor, " H"]]:
        """Azimuths and elevations that the field is rendered at, degrees: those of a spectrum."""
        return torch.tensor(beamformer.grid.azimuths_deg).float(), torch.tensor(beamformer.grid.elevations_deg).float()

    @property
    def has_primitives(self) -> bool:
        return True

    def splats(self, positions: Float[Tensor, "B 3"]) -> Splats:
        """The primitives as they are blended for each transmitter position.

        Args:
            positions: transmitter positions, metres, world frame.
        """
        primitives = self.primitives
        azimuth, elevation = primitives.azimuth, primitives.elevation
        gs_pe = positional_encoding(primitives.coordinates, PRIMITIVE_ORDER)
        tx_pe = positional_encoding(self.scaled(positions), self.tx_order)
        encodings = gs_pe[None], tx_pe[:, None]  # 1 N_p 51 and B 1 39
        features = self.bst(azimuth, elevation, *encodings)

        # Hierarchy-based mixing: c_i = (amp_static + w_scale amp_mod) e^{j(phase_static + phase_mod)}
        amplitude, phase = self.static(gs_pe).unbind(-1)
        if "dynamic" not in self.bypass:
            amplitude_mod, phase_mod = self.dynamic(features).unbind(-1)
            w_scale = torch.where(primitives.coarse, W_SCALE_COARSE, W_SCALE_FINE)
            amplitude = amplitude + w_scale * amplitude_mod
            phase = phase + phase_mod
        coefficient = torch.stack([amplitude * phase.cos(), amplitude * phase.sin()], dim=-1)

        # Offsets are added to the unconstrained parameters, so that scales stay positive and opacities in (0, 1).
        offset = positions.new_zeros(positions.shape[0], len(azimuth), 4)
        if "delta" not in self.bypass:
            offset = self.delta(*encodings, features)
        rotation = primitives.rotation + offset[..., 0]
        # The scale is bounded, since a primitive that shrinks to zero no longer gets a gradient.
        scale = (primitives.scale_raw + offset[..., 1:3].tanh()).exp().clamp(SCALE_LEAST, SCALE_MOST)
        opacity = (primitives.opacity_raw + offset[..., 3]).sigmoid()

        depth = torch.zeros_like(primitives.depth) if "order" in self.bypass else primitives.depth
        coefficient = coefficient.expand(positions.shape[0], -1, -1)
        return Splats(azimuth, elevation, depth, scale, rotation, opacity, coefficient)

    def field(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B H W 2"]:
        """The complex field F(φ, θ) of each transmitter position on this model's grid (real, imaginary)."""
        return splat(*self.splats(positions), self.azimuths, self.elevations)

    def forward(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B 90 360"]:
        """Predicted spectrum: SPS = |F|² at every pixel, which is fitted directly to the normalised spectra."""
        return power(self.field(positions))

    def coarse(self, positions: Float[Tensor, "B 3"], pixels: Quadrature) -> Float[Tensor, "B H W"]:
        azimuths, elevations = self.azimuths[pixels.columns], self.elevations[pixels.rows]
        return power(splat(*self.splats(positions), azimuths, elevations))


class BiSplatAperture(BiSplatWRF):
    """BiSplat-WRF whose field is received by the array, so that each prediction is a spectrum the array can measure.

    The responses of an array of MN elements are MN projections of the field on the array manifold a_m:
    y_m = Σ a_m(φ,θ) F(φ,θ) cosθ ΔφΔθ over all directions. The spectrum is S = |Σ_m y_m e^{-jk u·d_m}| / √(MN), min–max
    normalised like the dataset's spectra. The field is splatted on a 6° grid, which is finer than a 4 × 4 array
    resolves.

    Args:
        region: as for ``BiSplatWRF``.
        beamformer: the dataset's array and grid.
        options: as for ``BiSplatWRF``.
    """

    STEP_DEG = 6
    aperture: Tensor

    def __init__(self, region: Float[np.ndarray, "2 3"], beamformer: Beamformer, **options: Any):
        super().__init__(region, beamformer, **options)
        array = beamformer.array
        azimuths, elevations = (np.radians(axis.double().numpy()) for axis in self._grid(beamformer))
        elevation, azimuth = np.meshgrid(elevations, azimuths, indexing="ij")
        solid_angle = np.cos(elevation) * np.radians(self.STEP_DEG) ** 2  # cosθ ΔφΔθ
        aperture = (array.manifold(azimuth, elevation) * solid_angle[..., None]).reshape(-1, array.elements)
        self.register_buffer("aperture", on_pairs(aperture), persistent=False)
        self.beamforming = BeamformingLayer(beamformer)

    def _grid(self, beamformer: Beamformer) -> tuple[Float[Tensor, " W"], Float[Tensor, " H"]]:
        return torch.arange(0.0, 360.0, self.STEP_DEG), torch.arange(self.STEP_DEG / 2, 90.0, self.STEP_DEG)

    @property
    def has_responses(self) -> bool:
        return True

    def responses(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B elements 2"]:
        """Element responses y (real, imaginary); their scale and common phase are arbitrary."""
        return (self.field(positions).flatten(1) @ self.aperture).unflatten(-1, (-1, 2))

    def forward(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B 90 360"]:
        """Predicted spectrum: the array's spectrum of ``responses``, min–max normalised."""
        return self.beamforming(self.responses(positions))

    def coarse(self, positions: Float[Tensor, "B 3"], pixels: Quadrature) -> Float[Tensor, "B H W"]:
        return SpectrumModel.coarse(self, positions, pixels)
