"""GSRF [yang2025]: Gaussians in space with complex signals, drawn on a sphere around the transmitter."""

from __future__ import annotations

import math

import torch
from jaxtyping import Complex, Float
from torch import Tensor, nn

from learn.models.base import Region, SplatModel, power
from learn.models.quadrature import composite_loss
from learn.models.splatting.ordered import Conic, Ordered
from learn.models.splatting.splat import directions, neighbour_distance, rotation_matrix, splat_in_order
from simulate.spectra.beamformer import Beamformer

PUBLISHED = 3000  # number of Gaussians

EXTENT, LEAST_HALF = 2.72, 1.0
"""Gaussians start in a box so many times as large as that of the training positions, half of which counts as at least a
metre along each axis."""

DEGREE = 9  # degree of the expansion of a Gaussian's signal over directions: 100 complex numbers

FIRST_SIGNAL, FIRST_ATTENUATION = 0.0928, 0.1
"""Standard deviation of the first coefficients, and attenuation of all Gaussians at the start."""

RADIUS = 0.307  # radius of the sphere around the transmitter, metres
NEAREST = 1.5 * RADIUS  # Gaussians nearer to the transmitter are not seen, metres
LEAST_COSINE = 0.02  # least cosine of an elevation in the width of a Gaussian along azimuth

PLACE_PACE, MEAN_PACE, REST_PACE, ATTENUATION_PACE, SCALE_PACE, ROTATION_PACE = 0.8, 1.0, 0.193, 4.2, 0.5, 0.39
"""Learning rates relative to that of the coefficient of degree 0, 2.7e-3. The optimiser has one rate. A parameter that
is used times its pace moves as if it had its own."""

SSIM_WEIGHT, FOURIER_WEIGHT = 0.366, 0.1915
"""Weights of 1 − SSIM and of the squared difference of Fourier transforms in the loss; L1 has the rest."""

LEAST_POWER = 1e-8  # added to |F|² before the root, whose derivative is infinite at 0


class GSRF(SplatModel):
    """GSRF [yang2025]: ``F = Σ_i c_i α_i Π_{j<i} (1 − α_j)`` on a sphere around the transmitter, nearest first.

    Gaussian i has a place p_i, a covariance Σ_i, an attenuation a_i and complex coefficients w_i. From the transmitter
    it is seen in the direction u_i. The spectrum is |F| with

    - the signal ``c_i = Σ_lm w_ilm Y_lm(u_i)``, the Fourier-Legendre expansion of degree 9;
    - ``α_i(u) = a_i exp(−½ R² (u − u_i)ᵀ Σ_i⁻¹ (u − u_i))``. The Gaussian is moved along its ray to the sphere of
      radius R, and keeps its size. ``u − u_i`` is taken as linear in azimuth and elevation.

    There is no network. The transmitter's position decides from where the Gaussians are seen, and their order.
    """

    paces: Tensor

    def __init__(self, region: Region, beamformer: Beamformer, wavelength: float, *, primitives: int = PUBLISHED):
        super().__init__(region, beamformer, wavelength)
        half = EXTENT * torch.as_tensor((region[1] - region[0]) / 2).float().clamp_min(LEAST_HALF)
        place = half * (2 * torch.rand(primitives, 3) - 1)
        size = torch.from_numpy(neighbour_distance(place.numpy())).float()
        self.place = nn.Parameter(place / PLACE_PACE)
        self.scale_raw = nn.Parameter(size.log()[:, None].repeat(1, 3) / SCALE_PACE)
        self.quaternion = nn.Parameter(torch.tensor([1.0, 0.0, 0.0, 0.0]).repeat(primitives, 1) / ROTATION_PACE)
        self.attenuation_raw = nn.Parameter(
            torch.logit(torch.full((primitives,), FIRST_ATTENUATION)) / ATTENUATION_PACE
        )
        paces = torch.full(((DEGREE + 1) ** 2, 1), REST_PACE)
        paces[0] = MEAN_PACE
        self.register_buffer("paces", paces, persistent=False)
        self.coefficients = nn.Parameter(FIRST_SIGNAL * torch.randn(primitives, len(paces), 2) / paces)

    def drawn(
        self, positions: Float[Tensor, "B 3"], azimuths: Float[Tensor, " W"], elevations: Float[Tensor, " H"]
    ) -> Float[Tensor, "B H W"]:
        middle = self.region.mean(dim=0)
        away = PLACE_PACE * self.place - (positions - middle)[:, None]
        far = torch.linalg.vector_norm(away, dim=-1)
        azimuth, elevation, _ = directions(away)
        attenuation = (ATTENUATION_PACE * self.attenuation_raw).sigmoid()
        attenuation = torch.where((far > NEAREST) & (elevation > 0), attenuation, 0.0)
        basis = legendre_fourier(away / far.clamp_min(1e-6)[..., None], DEGREE)
        signal = torch.einsum("bnk,nk->bn", basis, torch.view_as_complex(self.paces * self.coefficients))
        order = far.detach().argsort(dim=1)
        sorted_attributes = (
            each.gather(1, order)
            for each in (azimuth, elevation, *self._conic(azimuth, elevation), attenuation, signal.real, signal.imag)
        )
        azimuth, elevation, a, b, c, attenuation, real, imaginary = sorted_attributes
        coefficient = torch.stack([real, imaginary], dim=-1)
        ordered = Ordered(azimuth, elevation, (a, b, c), attenuation, coefficient)
        return (power(splat_in_order(ordered, azimuths, elevations)) + LEAST_POWER).sqrt()

    def _conic(self, azimuth: Float[Tensor, "B N_p"], elevation: Float[Tensor, "B N_p"]) -> Conic:
        """a, b, c of ``R² Tᵀ Σ⁻¹ T`` per square degree, with the derivatives T of u by azimuth and elevation."""
        cos, sin = azimuth.deg2rad().cos(), azimuth.deg2rad().sin()
        high, across = elevation.deg2rad().sin(), elevation.deg2rad().cos().clamp_min(LEAST_COSINE)
        by_azimuth = torch.stack([-sin * across, cos * across, torch.zeros_like(cos)], dim=-1)
        by_elevation = torch.stack([-high * cos, -high * sin, across], dim=-1)
        rotation = rotation_matrix(ROTATION_PACE * self.quaternion)
        whiten = RADIUS * math.radians(1) * (-SCALE_PACE * self.scale_raw).exp()[..., None] * rotation.mT
        first, second = (torch.einsum("nij,bnj->bni", whiten, each) for each in (by_azimuth, by_elevation))
        return first.square().sum(-1), (first * second).sum(-1), second.square().sum(-1)

    def training_loss(self, positions: Float[Tensor, "B 3"], spectra: Float[Tensor, "B 90 360"]) -> Float[Tensor, ""]:
        """0.44 L1 + 0.37 (1 − SSIM) + 0.19 of the mean squared difference of the pictures' Fourier transforms.

        By Parseval's theorem this last term is the mean squared difference of the pictures themselves.
        """
        predicted, share = self(positions), SSIM_WEIGHT / (1 - FOURIER_WEIGHT)
        squared = (predicted - spectra).square().mean()
        return (1 - FOURIER_WEIGHT) * composite_loss(predicted, spectra, share) + FOURIER_WEIGHT * squared


def legendre_fourier(direction: Float[Tensor, "*batch 3"], degree: int) -> Complex[Tensor, "*batch terms"]:
    """``Y_lm(u) = √((2l + 1) (l − |m|)! / 4π (l + |m|)!) P_l^|m|(u_z) e^{jmφ}``, times (−1)^m for m < 0.

    The terms are those of l ≤ degree and −l ≤ m ≤ l; m rises fastest. The associated Legendre functions P have the
    Condon-Shortley phase.
    """
    x, y, z = direction.unbind(-1)
    turn = torch.complex(x, y)  # e^{jφ} times the sine of the polar angle
    legendre: dict[tuple[int, int], Tensor] = {(0, 0): torch.ones_like(z)}  # divided by the m-th power of that sine
    turns = [torch.ones_like(turn)]
    for m in range(degree + 1):
        if m:
            legendre[m, m] = -(2 * m - 1) * legendre[m - 1, m - 1]
            turns.append(turns[-1] * turn)
        for l in range(m + 1, degree + 1):  # noqa: E741
            before = (l + m - 1) * legendre[l - 2, m] if l > m + 1 else 0.0
            legendre[l, m] = ((2 * l - 1) * z * legendre[l - 1, m] - before) / (l - m)
    terms = []
    for l in range(degree + 1):  # noqa: E741
        for m in range(-l, l + 1):
            scale = math.sqrt((2 * l + 1) / (4 * math.pi) * math.factorial(l - abs(m)) / math.factorial(l + abs(m)))
            wave = turns[abs(m)] if m >= 0 else turns[-m].conj() * (-1) ** -m
            terms.append(scale * legendre[l, abs(m)] * wave)
    return torch.stack(terms, dim=-1)
