"""The bilinear spatial transformer (BST), through which the primitives exchange features on an angular grid."""

from __future__ import annotations

import math

import torch
from jaxtyping import Float
from torch import Tensor, nn

from learn.models.networks.feed_forward import Interpolated, LinearOfParts


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

    The paper does not give the grid's offset in elevation. Here the grid points are the centres of the cells,
    θ_j = (j + ½)Δθ. With θ_j = jΔθ, a primitive at boresight would have no weight at all.
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
        """Features of the primitives at (azimuth, elevation), degrees, with the encodings GS-PE and TX-PE."""
        local = self.project(*encodings)
        if self.transformer is None:
            return local
        weights = bilinear_weights(azimuth, elevation, self.clusters)
        # A grid point without a primitive nearby gets the feature 0 instead of 0/0.
        gather = weights / weights.sum(0).clamp_min(1e-6)
        spread = weights / weights.sum(1, keepdim=True)
        return Interpolated(spread, self.transformer(gather.T @ local))
