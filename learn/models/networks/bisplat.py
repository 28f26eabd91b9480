"""The paper's models BiSplat-WRF and BiSplat-WRF+ [zhang2026]: primitives, bilinear spatial transformer, and networks.

Symbols are the paper's: N_p primitives, N_c clusters, φ azimuth, θ elevation, ρ in-plane rotation, c_i complex
coefficient. What the paper leaves open, and what was chosen, is in the documentation, The models."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal, get_args

import torch
from jaxtyping import Float
from torch import Tensor, nn

from learn.models.base import Region, SplatModel, power
from learn.models.encoding import PRIMITIVE_ORDER, TransmitterEncoding, positional_encoding
from learn.models.networks.feed_forward import Interpolated, LinearOfParts, ResidualFFN
from learn.models.splatting.splat import Splats, splat
from scenes.files.errors import ParameterError, shown
from simulate.spectra.beamformer import Beamformer

COARSE_FRACTION = 0.3  # fraction of the primitives that are coarse, the first ones; the others are fine
COARSE_DEPTHS, FINE_DEPTHS = (20.0, 50.0), (1.0, 20.0)  # ranges of the initial depths, without unit
NEAR, FAR = 0.1, 100.0  # depths at which z_norm is 0 and 1: z_norm = (d − 0.1) / (100 − 0.1) in the paper
SCALE_MIN, SCALE_MAX = 2.0, 10.0  # s_min and s_max, degrees; the paper gives no values

SCALE_LEAST, SCALE_MOST = 0.5, 60.0
"""Bounds of a primitive's standard deviation, degrees: half a pixel, and a sixth of a turn."""

INITIAL_OPACITY = 0.3  # initial opacity of every primitive


class Primitives(nn.Module):
    """N_p planar Gaussians parallel to the (φ, θ) plane, each with a depth. All attributes are learned."""

    coarse: Tensor  # whether each primitive belongs to the coarse group, which is fixed at initialisation

    def __init__(self, count: int):
        super().__init__()
        coarse = torch.arange(count) < round(COARSE_FRACTION * count)
        low = torch.where(coarse, COARSE_DEPTHS[0], FINE_DEPTHS[0])
        high = torch.where(coarse, COARSE_DEPTHS[1], FINE_DEPTHS[1])
        depth = low + (high - low) * torch.rand(count)
        z_norm = (depth - NEAR) / (FAR - NEAR)
        base = SCALE_MIN + (SCALE_MAX - SCALE_MIN) * torch.exp(-z_norm)
        scale = base[:, None] * (1 + 0.5 * torch.rand(count, 2))

        self.register_buffer("coarse", coarse)
        self.azimuth_radians = nn.Parameter(2 * torch.pi * torch.rand(count))
        self.elevation_raw = nn.Parameter(torch.logit(torch.rand(count).clamp(0.01, 0.99)))
        self.depth_raw = nn.Parameter(depth.log())
        self.scale_raw = nn.Parameter(scale.log())
        self.rotation = nn.Parameter(torch.pi * torch.rand(count))
        self.opacity_raw = nn.Parameter(torch.logit(torch.full((count,), INITIAL_OPACITY)))

    @property
    def azimuth(self) -> Float[Tensor, " N_p"]:
        """φ, degrees, in [0, 360)."""
        return self.azimuth_radians.rad2deg().remainder(360)

    @property
    def elevation(self) -> Float[Tensor, " N_p"]:
        """θ, degrees, in (0, 90)."""
        return 90 * self.elevation_raw.sigmoid()

    @property
    def depth(self) -> Float[Tensor, " N_p"]:
        """d > 0, without unit: a monotonic proxy of the scatterer's distance, which orders the blending."""
        return self.depth_raw.exp()

    @property
    def coordinates(self) -> Float[Tensor, "N_p 3"]:
        """(φ, θ, d) scaled to about −1…1, the input of GS-PE. A full turn of φ is one period of its lowest octave."""
        return torch.stack([self.azimuth / 180 - 1, self.elevation / 45 - 1, self.depth / 25 - 1], dim=-1)


def side_of(clusters: int) -> int:
    """√N_c, the number of grid points along each side."""
    side = math.isqrt(clusters)
    if side * side != clusters:
        raise ValueError(f"expected a square number of clusters, found {clusters}")
    return side


def bilinear_weights(
    azimuth: Float[Tensor, " N_p"], elevation: Float[Tensor, " N_p"], clusters: int
) -> Float[Tensor, "N_p N_c"]:
    """Weight w_ij of primitive i at grid point j (paper, BST for global context modelling).

    ``w_ij = max(0, 1 − d_φ/Δφ) · max(0, 1 − |θ_i − θ_j|/Δθ)``, with the periodic ``d_φ = min(|φ_i − φ_j|, 360° −
    |…|)``, on a √N_c × √N_c grid with Δφ = 360°/√N_c and Δθ = 90°/√N_c.

    The paper does not give θ_j. Here it is (j + ½)Δθ: with jΔθ, a primitive at boresight would have no weight at all.
    """
    side = side_of(clusters)
    step_azimuth, step_elevation = 360 / side, 90 / side
    index = torch.arange(side, device=azimuth.device, dtype=azimuth.dtype)
    azimuth_distance = (azimuth[:, None] - index * step_azimuth).remainder(360)
    azimuth_distance = torch.minimum(azimuth_distance, 360 - azimuth_distance)
    elevation_distance = (elevation[:, None] - (index + 0.5) * step_elevation).abs()
    azimuth_weight = (1 - azimuth_distance / step_azimuth).clamp_min(0)
    elevation_weight = (1 - elevation_distance / step_elevation).clamp_min(0)
    return (elevation_weight[:, :, None] * azimuth_weight[:, None, :]).flatten(1)


class BilinearSpatialTransformer(nn.Module):
    """Gathers local features f_i on a grid, transforms them, and interpolates global-aware features f'_i.

    With the weights w_ij of ``bilinear_weights``: ``g_j = Σ_i w_ij f_i / Σ_i w_ij``, ``G' = Transformer(G)`` and
    ``f'_i = Σ_j w_ij g'_j / Σ_j w_ij``.
    """

    def __init__(self, inputs: int, width: int, clusters: int, layers: int, heads: int, ffn_width: int, bypass: bool):
        super().__init__()
        side_of(clusters)  # refuses another number now rather than in training
        self.clusters = clusters
        self.project = LinearOfParts(inputs, width)
        self.transformer: nn.TransformerEncoder | None = None
        if not bypass:
            layer = nn.TransformerEncoderLayer(
                width, heads, ffn_width, dropout=0.0, activation="gelu", batch_first=True, norm_first=True
            )
            self.transformer = nn.TransformerEncoder(layer, layers, enable_nested_tensor=False)

    def forward(
        self,
        azimuth: Float[Tensor, " N_p"],
        elevation: Float[Tensor, " N_p"],
        *encodings: Float[Tensor, "#B #N_p _inputs"],
    ) -> Float[Tensor, "B N_p width"] | Interpolated:
        local = self.project(*encodings)
        if self.transformer is None:
            return local
        weights = bilinear_weights(azimuth, elevation, self.clusters)
        # A grid point without a primitive nearby gets the feature 0 instead of 0/0.
        gather = weights / weights.sum(0).clamp_min(1e-6)
        spread = weights / weights.sum(1, keepdim=True)
        return Interpolated(spread, self.transformer(gather.T @ local))


Bypass = Literal["dynamic", "delta", "bst", "order"]
"""Branches that can be switched off: three from the paper's ablation table, and "order", the ordering by depth."""

W_SCALE_COARSE, W_SCALE_FINE = 0.5, 1.0
"""w_scale of the hierarchy-based mixing: smaller for coarse primitives, to keep the background stable."""


TRANSFORMER_HEADS = 4


class BiSplatWRF(SplatModel):
    """The paper's model. The defaults are those of BiSplat-WRF; the registry has those of BiSplat-WRF+."""

    def __init__(
        self,
        region: Region,
        beamformer: Beamformer,
        wavelength: float,
        *,
        primitives: int = 500,
        clusters: int = 64,
        ffn_width: int = 128,
        ffn_layers: int = 4,
        transformer_layers: int = 3,
        transformer_ffn_width: int = 256,
        bypass: Sequence[Bypass] = (),
    ):
        super().__init__(region, beamformer, wavelength)
        unknown = sorted(set(bypass) - set(get_args(Bypass)))
        if unknown:
            raise ParameterError("bypass", f"expected some of {', '.join(get_args(Bypass))}, found {shown(unknown[0])}")
        self.bypass = frozenset(bypass)
        self.encoding = TransmitterEncoding("octaves")
        gs_pe, tx_pe = 3 * (2 * PRIMITIVE_ORDER + 1), self.encoding.size
        self.primitives = Primitives(primitives)
        self.static = ResidualFFN(gs_pe, 2, ffn_width, ffn_layers)
        self.bst = BilinearSpatialTransformer(
            gs_pe + tx_pe,
            ffn_width,
            clusters,
            transformer_layers,
            TRANSFORMER_HEADS,
            transformer_ffn_width,
            bypass="bst" in bypass,
        )
        self.dynamic = ResidualFFN(ffn_width, 2, ffn_width, ffn_layers)
        self.delta = ResidualFFN(gs_pe + tx_pe + ffn_width, 4, ffn_width, ffn_layers)

    def undecayed(self) -> list[nn.Parameter]:
        return list(self.primitives.parameters())

    def splats(self, positions: Float[Tensor, "B 3"]) -> Splats:
        primitives = self.primitives
        azimuth, elevation = primitives.azimuth, primitives.elevation
        gs_pe = positional_encoding(primitives.coordinates, PRIMITIVE_ORDER)
        tx_pe = self.encoding(positions, self.region, self.wavelength)
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
        return splat(self.splats(positions), self.azimuths, self.elevations)

    def drawn(
        self, positions: Float[Tensor, "B 3"], azimuths: Float[Tensor, " W"], elevations: Float[Tensor, " H"]
    ) -> Float[Tensor, "B H W"]:
        """``SPS = |F|²`` at every pixel, which is fitted directly to the normalised spectra."""
        return power(splat(self.splats(positions), azimuths, elevations))
