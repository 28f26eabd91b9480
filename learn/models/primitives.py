"""The planar Gaussian primitives: what each one is, and the paper's initialisation."""

from __future__ import annotations

import torch
from jaxtyping import Float
from torch import Tensor, nn

COARSE_FRACTION = 0.3
"""The first 30 % of the primitives are coarse, the others fine."""

COARSE_DEPTHS, FINE_DEPTHS = (20.0, 50.0), (1.0, 20.0)
NEAR, FAR = 0.1, 100.0
"""Depths between which z_norm runs from 0 to 1 (paper: z_norm = (d − 0.1) / (100 − 0.1))."""

SCALE_MIN, SCALE_MAX = 2.0, 10.0
"""s_min and s_max in degrees; the paper gives no value (docs/model.md)."""

INITIAL_OPACITY = 0.3


class Primitives(nn.Module):
    """N_p planar Gaussians parallel to the (φ, θ) plane, with a depth; every attribute is learned.

    Unconstrained parameters are stored; the properties give the physical values. Angles are degrees.

    Attributes:
        coarse: which primitives belong to the coarse group, fixed at initialisation.
    """

    coarse: Tensor

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
        self.azimuth_raw = nn.Parameter(360 * torch.rand(count))
        self.elevation_raw = nn.Parameter(torch.logit(torch.rand(count).clamp(0.01, 0.99)))
        self.depth_raw = nn.Parameter(depth.log())
        self.scale_raw = nn.Parameter(scale.log())
        self.rotation = nn.Parameter(torch.pi * torch.rand(count))
        self.opacity_raw = nn.Parameter(torch.logit(torch.full((count,), INITIAL_OPACITY)))

    @property
    def azimuth(self) -> Float[Tensor, " N_p"]:
        """φ in [0, 360) degrees; the parameter may leave that range, the angle is periodic."""
        return self.azimuth_raw.remainder(360)

    @property
    def elevation(self) -> Float[Tensor, " N_p"]:
        """θ in (0, 90) degrees."""
        return 90 * self.elevation_raw.sigmoid()

    @property
    def depth(self) -> Float[Tensor, " N_p"]:
        """d > 0, a monotonic proxy of the scatterer's distance: it orders the blending."""
        return self.depth_raw.exp()

    @property
    def coordinates(self) -> Float[Tensor, "N_p 3"]:
        """(φ, θ, d) scaled to about −1…1, the input of GS-PE. One turn of φ is one period of γ's slowest wave."""
        return torch.stack([self.azimuth / 180 - 1, self.elevation / 45 - 1, self.depth / 25 - 1], dim=-1)
