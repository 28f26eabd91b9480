"""The planar Gaussian primitives, their learned attributes and the paper's initialisation."""

from __future__ import annotations

import torch
from jaxtyping import Float
from torch import Tensor, nn

COARSE_FRACTION = 0.3
"""Fraction of the primitives that are coarse, the first ones; the others are fine."""

COARSE_DEPTHS, FINE_DEPTHS = (20.0, 50.0), (1.0, 20.0)
"""Ranges of the initial depths, without unit."""

NEAR, FAR = 0.1, 100.0
"""Depths at which z_norm is 0 and 1: z_norm = (d − 0.1) / (100 − 0.1) in the paper."""

SCALE_MIN, SCALE_MAX = 2.0, 10.0
"""s_min and s_max, degrees; the paper gives no values."""

SCALE_LEAST, SCALE_MOST = 0.5, 60.0
"""Bounds of a primitive's standard deviation, degrees: half a pixel, and a sixth of a turn."""

INITIAL_OPACITY = 0.3
"""Initial opacity of every primitive."""


class Primitives(nn.Module):
    """N_p planar Gaussians parallel to the (φ, θ) plane, each with a depth. All attributes are learned.

    The parameters are unconstrained; the properties compute the physical values from them. The parameters have scales
    at which a step of Adam moves all of them; azimuths in degrees would hardly move.
    """

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
