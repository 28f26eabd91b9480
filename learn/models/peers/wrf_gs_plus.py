"""WRF-GS+ [wen2024]: Gaussians in space whose shapes and signals a network changes by the transmitter's position."""

from __future__ import annotations

import torch
from jaxtyping import Float
from torch import Tensor, nn

from learn.models.base import Region, SplatModel
from learn.models.encoding import positional_encoding
from learn.models.networks.feed_forward import SkipNetwork
from learn.models.peers.swiftwrf import clipped_magnitude
from learn.models.quadrature import composite_loss
from learn.models.splatting.ordered import Ordered
from learn.models.splatting.splat import conic_of_axes, directions, neighbour_distance, rotation_matrix, splat_in_order
from simulate.spectra.beamformer import Beamformer

PUBLISHED = 200_000  # number of Gaussians at the start of the authors' runs

WIDTH, LAYERS, AGAIN = 256, 8, 5
"""Width and number of layers of the deformation network, and the number of the layer that sees the inputs again."""

PLACE_OCTAVES, POSITION_OCTAVES, POSITION_FEATURES = 10, 6, 90
"""Octaves of a Gaussian's place and of the transmitter's position, and size of what two layers make of the latter."""

SPREAD = 20.0  # standard deviation of the first places along each axis, metres
FIRST_OPACITY = 0.1  # opacity of all Gaussians at the start
ZONAL = 0.28209479  # spherical harmonic of degree 0, 1 / (2 √π), the unit of a Gaussian's signal
BLUR = 0.3  # added to the variances on the plane, square degrees: no Gaussian is narrower than about a pixel
NEAREST = 0.2  # gaussians that come closer to the gateway are not seen, metres

SIGNAL_PACE, OPACITY_PACE, SCALE_PACE, ROTATION_PACE = 3.1, 31.0, 6.2, 1.2
"""Learning rates relative to that of the network and of the places, 8e-4. The optimiser has one rate. A parameter that
is used times its pace moves as if it had its own."""

SSIM_WEIGHT = 0.2  # weight of 1 − SSIM in the loss


class WRFGSPlus(SplatModel):
    """WRF-GS+ [wen2024]: ``F(φ, θ) = Σ_i c_i α_i Π_{j<i} (1 − α_j)``, nearer Gaussians first; the spectrum is |F|.

    Gaussian i has a place p_i in the gateway's frame, axes s_i, a quaternion q_i, an opacity o_i and a static signal
    f_i of two parts. From p_i and the transmitter's position r the network predicts how it is deformed:

    - ``c_i = max(0, (f_i + |m_i(r)|) / (2 √π) + ½)`` is its signal, with the dynamic part m_i;
    - ``Σ_i = R_i diag(e^{s_i} + s'_i(r))² R_iᵀ`` is its covariance in space, with ``R_i = R(q_i + q'_i(r))``;
    - ``α_i = o_i G_i(φ, θ)``, where G_i is a Gaussian with covariance ``J Σ_i Jᵀ`` on the plane of the picture, around
      φ and ``θ = (λ + 90°) / 2`` for the direction (φ, λ) of p_i.

    The two parts of F are clipped to 0…1.
    """

    def __init__(
        self,
        region: Region,
        beamformer: Beamformer,
        wavelength: float,
        *,
        primitives: int = PUBLISHED,
        width: int = WIDTH,
    ):
        super().__init__(region, beamformer, wavelength)
        place = SPREAD * torch.randn(primitives, 3)
        size = torch.from_numpy(neighbour_distance(place.numpy())).float()
        self.place = nn.Parameter(place)
        self.scale_raw = nn.Parameter(size.log()[:, None].repeat(1, 3) / SCALE_PACE)
        self.quaternion = nn.Parameter(torch.tensor([1.0, 0.0, 0.0, 0.0]).repeat(primitives, 1) / ROTATION_PACE)
        self.opacity_raw = nn.Parameter(torch.logit(torch.full((primitives,), FIRST_OPACITY)) / OPACITY_PACE)
        self.signal = nn.Parameter((torch.rand(primitives, 2) - 0.5) / ZONAL / SIGNAL_PACE)
        self.deformation = DeformationOfSpace(width)

    def drawn(
        self, positions: Float[Tensor, "B 3"], azimuths: Float[Tensor, " W"], elevations: Float[Tensor, " H"]
    ) -> Float[Tensor, "B H W"]:
        order = torch.argsort(self.place.detach().square().sum(-1))
        place = self.place[order]
        turn, stretch, dynamic = self.deformation(place.detach(), positions - self.region.mean(dim=0))
        azimuth, latitude, change = directions(place)
        change = change * change.new_tensor([[1.0], [0.5]])  # θ = (λ + 90) / 2
        rotation = rotation_matrix(ROTATION_PACE * self.quaternion[order] + turn)
        scale = (SCALE_PACE * self.scale_raw[order]).exp() + stretch
        conic = conic_of_axes(change @ rotation * scale[..., None, :], BLUR)
        opacity = (OPACITY_PACE * self.opacity_raw[order]).sigmoid()
        opacity = torch.where(torch.linalg.vector_norm(place, dim=-1) > NEAREST, opacity, 0.0)
        signal = (ZONAL * (SIGNAL_PACE * self.signal[order] + dynamic.abs()) + 0.5).relu()
        ordered = Ordered(azimuth, (latitude + 90) / 2, conic, opacity.expand(len(positions), -1), signal)
        return clipped_magnitude(splat_in_order(ordered, azimuths, elevations))

    def training_loss(self, positions: Float[Tensor, "B 3"], spectra: Float[Tensor, "B 90 360"]) -> Float[Tensor, ""]:
        """0.8 L1 + 0.2 (1 − SSIM) at all pixels."""
        return composite_loss(self(positions), spectra, SSIM_WEIGHT)


class DeformationOfSpace(SkipNetwork):
    """How each Gaussian changes with the transmitter's position. All layers but the last ones have ReLUs."""

    def __init__(self, width: int):
        super().__init__(3 * (2 * PLACE_OCTAVES + 1) + POSITION_FEATURES, width, LAYERS, AGAIN)
        self.position = nn.Sequential(
            nn.Linear(3 * (2 * POSITION_OCTAVES + 1), width), nn.ReLU(), nn.Linear(width, POSITION_FEATURES)
        )
        self.heads = nn.ModuleList(nn.Linear(width, outputs) for outputs in (4, 3, 2))

    def forward(
        self, place: Float[Tensor, "N_p 3"], position: Float[Tensor, "B 3"]
    ) -> tuple[Float[Tensor, "B N_p 4"], Float[Tensor, "B N_p 3"], Float[Tensor, "B N_p 2"]]:
        """What is added to the quaternions and to the axes (metres), and the dynamic signal."""
        transmitter = self.position(positional_encoding(position, POSITION_OCTAVES, lowest=1.0))
        features = self.features(positional_encoding(place, PLACE_OCTAVES, lowest=1.0)[None], transmitter[:, None])
        turn, stretch, dynamic = (head(features) for head in self.heads)
        return turn, stretch, dynamic
