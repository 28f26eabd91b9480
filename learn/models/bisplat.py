"""BiSplat-WRF and BiSplat-WRF+ (the paper), and BiSplat-aperture (ours): transmitter position -> spectrum.

Symbols are the paper's: N_p primitives, N_c clusters, φ azimuth, θ elevation, ρ in-plane rotation, c_i complex
coefficient. docs/model.md lists what the paper leaves open and what was chosen.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from learn.models.base import Beamformer, SpectrumModel, on_pairs, power
from learn.models.bst import BilinearSpatialTransformer
from learn.models.encoding import PRIMITIVE_ORDER, TX_ORDER, positional_encoding
from learn.models.networks import ResidualFFN
from learn.models.primitives import Primitives
from learn.models.splat import splat
from simulate.angular_grid import AZIMUTHS_DEG, ELEVATIONS_DEG
from simulate.array import PlanarArray

Bypass = Literal["dynamic", "delta", "bst", "order"]
"""The branches of the paper's ablation table; and the order of blending, by depth or as the primitives are stored."""

W_SCALE_COARSE, W_SCALE_FINE = 0.5, 1.0
"""w_scale of the hierarchy-based mixing: small for coarse primitives, to keep the background stable."""


SCALE_LEAST, SCALE_MOST = 0.5, 60.0
"""Degrees; a primitive narrower than a pixel or wider than the chart's periodicity allows means nothing."""


@dataclass(frozen=True)
class ModelSize:
    """Widths, depths and counts of the paper's implementation details; the defaults are BiSplat-WRF's."""

    primitives: int = 500
    clusters: int = 64
    ffn_width: int = 128
    ffn_layers: int = 4
    transformer_layers: int = 3
    transformer_heads: int = 4
    transformer_ffn_width: int = 256
    tx_order: int = TX_ORDER


PLUS = ModelSize(primitives=2000, ffn_width=256, ffn_layers=12, transformer_layers=6, transformer_ffn_width=512)
"""BiSplat-WRF+."""

APERTURE = ModelSize(tx_order=3)
"""Ours: a quarter of the region is the shortest wave in TX-PE; shorter ones learn the positions by heart."""


class Splats(NamedTuple):
    """Primitives as they are blended for transmitters: the first arguments of ``splat``. Degrees; ρ in radians."""

    azimuth: Float[Tensor, " N_p"]
    elevation: Float[Tensor, " N_p"]
    depth: Float[Tensor, " N_p"]
    scale: Float[Tensor, "B N_p 2"]
    rotation: Float[Tensor, "B N_p"]
    opacity: Float[Tensor, "B N_p"]
    coefficient: Float[Tensor, "B N_p 2"]


class BiSplatWRF(SpectrumModel):
    """The paper's model.

    Args:
        size: widths, depths and counts.
        region: corners (min, max) of the box of training positions, metres; scales the input of TX-PE to −1…1.
        bypass: branches whose output is zeroed (BST: replaced by its linear projection).
    """

    azimuths: Tensor
    elevations: Tensor

    def __init__(self, size: ModelSize, region: Float[np.ndarray, "2 3"], bypass: frozenset[Bypass] = frozenset()):
        super().__init__(region)
        self.bypass, self.tx_order = bypass, size.tx_order
        azimuths, elevations = self._grid()
        self.register_buffer("azimuths", azimuths, persistent=False)
        self.register_buffer("elevations", elevations, persistent=False)
        gs_pe, tx_pe = 3 * (2 * PRIMITIVE_ORDER + 1), 3 * (2 * size.tx_order + 1)
        width, layers = size.ffn_width, size.ffn_layers
        self.primitives = Primitives(size.primitives)
        self.static = ResidualFFN(gs_pe, 2, width, layers)
        self.bst = BilinearSpatialTransformer(
            gs_pe + tx_pe,
            width,
            size.clusters,
            size.transformer_layers,
            size.transformer_heads,
            size.transformer_ffn_width,
            bypass="bst" in bypass,
        )
        self.dynamic = ResidualFFN(width, 2, width, layers)
        self.delta = ResidualFFN(gs_pe + tx_pe + width, 4, width, layers)

    def _grid(self) -> tuple[Float[Tensor, " W"], Float[Tensor, " H"]]:
        """Columns and rows the field is rendered at, degrees: here the spectrum's own."""
        return torch.tensor(AZIMUTHS_DEG).float(), torch.tensor(ELEVATIONS_DEG).float()

    def splats(self, positions: Float[Tensor, "B 3"]) -> Splats:
        """What the primitives become for each transmitter.

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

        # Offsets are added to the unconstrained attributes, so that scales stay positive and opacities in (0, 1).
        offset = positions.new_zeros(positions.shape[0], len(azimuth), 4)
        if "delta" not in self.bypass:
            offset = self.delta(*encodings, features)
        rotation = primitives.rotation + offset[..., 0]
        # Bounded, since a primitive that shrinks to nothing takes the gradient with it.
        scale = (primitives.scale_raw + offset[..., 1:3].tanh()).exp().clamp(SCALE_LEAST, SCALE_MOST)
        opacity = (primitives.opacity_raw + offset[..., 3]).sigmoid()

        depth = torch.zeros_like(primitives.depth) if "order" in self.bypass else primitives.depth
        coefficient = coefficient.expand(positions.shape[0], -1, -1)
        return Splats(azimuth, elevation, depth, scale, rotation, opacity, coefficient)

    def field(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B H W 2"]:
        """The complex field F(φ, θ) of each transmitter on this model's grid, real and imaginary part."""
        return splat(*self.splats(positions), self.azimuths, self.elevations)

    def forward(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B 90 360"]:
        """Predicted picture: SPS = |F|² at every pixel, fitted directly to the normalised pictures."""
        return power(self.field(positions))


class BiSplatAperture(BiSplatWRF):
    """BiSplat-WRF whose field is seen through the array: every prediction is a spectrum this array could measure.

    An array of MN elements cannot see more than an MN-dimensional slice of the field:
    y_m = Σ_directions a_m(φ,θ) F(φ,θ) cosθ ΔΩ, then S = |Σ_m y_m e^{-jk u·d_m}| / √(MN), min–max normalised as the
    pictures are. The field is splatted on a 6° grid only, finer than anything a 4 × 4 array resolves.

    Args:
        array: the gateway's array.
        (others): as ``BiSplatWRF``.
    """

    STEP_DEG = 6
    aperture: Tensor

    def __init__(
        self,
        size: ModelSize,
        region: Float[np.ndarray, "2 3"],
        array: PlanarArray,
        bypass: frozenset[Bypass] = frozenset(),
    ):
        super().__init__(size, region, bypass)
        azimuths, elevations = (np.radians(axis.double().numpy()) for axis in self._grid())
        elevation, azimuth = np.meshgrid(elevations, azimuths, indexing="ij")
        solid_angle = np.cos(elevation) * np.radians(self.STEP_DEG) ** 2  # cosθ ΔφΔθ
        aperture = (array.manifold(azimuth, elevation) * solid_angle[..., None]).reshape(-1, array.elements)
        self.register_buffer("aperture", on_pairs(aperture), persistent=False)
        self.beamformer = Beamformer(array)

    def _grid(self) -> tuple[Float[Tensor, " W"], Float[Tensor, " H"]]:
        return torch.arange(0.0, 360.0, self.STEP_DEG), torch.arange(self.STEP_DEG / 2, 90.0, self.STEP_DEG)

    @property
    def has_responses(self) -> bool:
        return True

    def responses(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B elements 2"]:
        """Element responses y, real and imaginary; trained on pictures alone, scale and common phase are arbitrary."""
        return (self.field(positions).flatten(1) @ self.aperture).unflatten(-1, (-1, 2))

    def forward(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B 90 360"]:
        """Predicted picture: magnitude spectrum of ``responses``, min–max normalised."""
        return self.beamformer(self.responses(positions))
