"""SwiftWRF [liu2025]: planar Gaussians, summed without depth order, that a network deforms by position."""

from __future__ import annotations

import math

import torch
from jaxtyping import Float
from torch import Tensor, nn

from learn.models.base import Region, SplatModel, power
from learn.models.encoding import positional_encoding
from learn.models.networks.feed_forward import SkipNetwork
from learn.models.splatting.ordered import Ordered
from learn.models.splatting.splat import splat_in_order
from simulate.spectra.beamformer import Beamformer

PUBLISHED = 10_000  # number of Gaussians of the authors' runs
WIDTH, LAYERS = 156, 8  # width and number of layers of the deformation network

PLACE_OCTAVES, POSITION_OCTAVES = 10, 6
"""Octaves of the encodings of a Gaussian's place and of the transmitter's position."""

SMALLEST_SCALE = 0.5
"""Added to the diagonal of a Gaussian's Cholesky factor, degrees, with the published number of Gaussians."""

NARROWEST = 0.05  # least diagonal of a Cholesky factor, degrees; no pixel sees a narrower Gaussian

FAINT = 1e-9
"""Opacity of every Gaussian in the renderer, so small that Π (1 − FAINT) is 1 and alpha blending becomes addition."""

LEAST_POWER = 1e-12  # keeps the derivative of |F| finite where F is zero


class SwiftWRF(SplatModel):
    """SwiftWRF [liu2025]: the magnitude of a sum of deformed Gaussians, ``S(φ, θ) = |Σ_i o_i c_i G_i(φ, θ)|``.

    Each Gaussian has a centre, the Cholesky factor of its covariance, an opacity o_i and a coefficient c_i of a real
    and an imaginary part. A network moves the centre and changes o_i and c_i, given the centre and the transmitter's
    position. The real and the imaginary part of the sum are clipped to 0…1.
    """

    def __init__(
        self,
        region: Region,
        beamformer: Beamformer,
        wavelength: float,
        *,
        primitives: int = PUBLISHED,
    ):
        super().__init__(region, beamformer, wavelength)
        self.size = math.sqrt(PUBLISHED / primitives)
        self.place = nn.Parameter(torch.atanh(2 * torch.rand(primitives, 2).clamp_min(1e-6) - 1))
        self.cholesky = nn.Parameter(torch.rand(primitives, 3))
        self.opacity = nn.Parameter(torch.rand(primitives))
        self.coefficient = nn.Parameter(torch.rand(primitives, 2))
        self.deformation = DeformationNetwork()

    def drawn(
        self, positions: Float[Tensor, "B 3"], azimuths: Float[Tensor, " W"], elevations: Float[Tensor, " H"]
    ) -> Float[Tensor, "B H W"]:
        middle = self.region.mean(dim=0)
        move, fade, change = self.deformation(self.place.tanh(), positions - middle)
        place = (self.place + move).tanh()
        azimuth = (180 * (place[..., 0] + 1)).remainder(360)
        a, b, c = (entry.expand_as(azimuth) for entry in self._conic())
        elevation = 45 * (place[..., 1] + 1)
        weight = (self.opacity + fade[..., 0])[..., None] * (self.coefficient + change)
        ordered = Ordered(azimuth, elevation, (a, b, c), torch.full_like(azimuth, FAINT), weight / FAINT)
        return clipped_magnitude(splat_in_order(ordered, azimuths, elevations))

    def _conic(self) -> tuple[Float[Tensor, " N_p"], ...]:
        """a, b, c of Σ⁻¹ = [[a, b], [b, c]] for Σ = L Lᵀ with L = [[l_0, 0], [l_1, l_2]], per square degree."""
        across, slope, along = (self.size * self.cholesky).unbind(-1)
        across, along = ((own + self.size * SMALLEST_SCALE).clamp_min(NARROWEST) for own in (across, along))
        determinant = (across * along).square()
        return (slope.square() + along.square()) / determinant, -across * slope / determinant, along.pow(-2)


class DeformationNetwork(SkipNetwork):
    """How each Gaussian changes with the transmitter's position: a network of ReLU layers, one of which sees the inputs
    again, and a head of two layers for each of the three changes.
    """

    def __init__(self) -> None:
        inputs = 2 * (2 * PLACE_OCTAVES + 1) + 3 * (2 * POSITION_OCTAVES + 1)
        super().__init__(inputs, WIDTH, LAYERS, LAYERS // 2)
        self.heads = nn.ModuleList(
            nn.Sequential(nn.Linear(WIDTH, WIDTH), nn.ReLU(), nn.Linear(WIDTH, outputs)) for outputs in (2, 1, 2)
        )

    def forward(
        self, place: Float[Tensor, "N_p 2"], position: Float[Tensor, "B 3"]
    ) -> tuple[Float[Tensor, "B N_p 2"], Float[Tensor, "B N_p 1"], Float[Tensor, "B N_p 2"]]:
        """Changes of the place (before the hyperbolic tangent), of the opacity and of the coefficient."""
        x = self.features(
            positional_encoding(place, PLACE_OCTAVES, lowest=1.0)[None],
            positional_encoding(position, POSITION_OCTAVES, lowest=1.0)[:, None],
        )
        move, fade, change = (head(x) for head in self.heads)
        return move, fade, change


def clipped_magnitude(field: Float[Tensor, "B H W 2"]) -> Float[Tensor, "B H W"]:
    """Magnitude of a field whose real and imaginary part are clipped to 0…1: at most √2."""
    return power(field.clamp(0, 1)).clamp_min(LEAST_POWER).sqrt()
