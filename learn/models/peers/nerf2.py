"""NeRF² [zhao2023], written from the paper, for spectra, whose pixels have rays from the gateway, and one element."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor, nn

from learn.models.base import Region, SpectrumModel
from learn.models.encoding import TransmitterEncoding, positional_encoding
from learn.models.model_settings import OPTION_MOST
from learn.models.networks.feed_forward import LinearOfParts
from learn.models.quadrature import interpolation, picture_pixels
from scenes.files.errors import require_whole
from simulate.spectra.angular_grid import COLUMNS
from simulate.spectra.beamformer import Beamformer


class RadianceField(nn.Module):
    """Attenuation network and radiance network, which the models of spectra, powers and channels share."""

    def __init__(self, place: int, others: int, width: int, layers: int, frequencies: int = 1):
        super().__init__()
        self.inward = nn.Linear(place, width)
        half = layers // 2
        self.first = nn.ModuleList(nn.Linear(width, width) for _ in range(half))
        self.skip = LinearOfParts(width + place, width)
        self.second = nn.ModuleList(nn.Linear(width, width) for _ in range(layers - half - 2))
        self.attenuation = nn.Linear(width, 2 * frequencies)
        self.feature = nn.Linear(width, width)
        self.radiance = LinearOfParts(width + others, width)
        last = nn.Linear(width // 2, 2 * frequencies)
        self.signal = nn.Sequential(nn.ReLU(), nn.Linear(width, width // 2), nn.ReLU(), last)

    def voxels(
        self, places: Float[Tensor, "*voxels place"]
    ) -> tuple[Float[Tensor, "*voxels outputs"], Float[Tensor, "*voxels width"]]:
        """Unconstrained attenuations and phase shifts of voxels, and their features, whatever the transmitter."""
        x = self.inward(places).relu()
        for layer in self.first:
            x = layer(x).relu()
        x = self.skip(x, places).relu()
        for layer in self.second:
            x = layer(x).relu()
        return self.attenuation(x), self.feature(x)

    def signals(
        self, feature: Float[Tensor, "*voxels width"], *others: Float[Tensor, "*#batch _inputs"]
    ) -> Float[Tensor, "*batch outputs"]:
        """Unconstrained amplitudes and phases of the signals that voxels send back: all amplitudes, then phases."""
        return self.signal(self.radiance(feature, *others))


ORDER = 10  # number of octaves of all encodings


@dataclass(frozen=True)
class RaySize:
    """Size of the networks, and number of rays and voxels."""

    azimuths: int = 36  # azimuths and elevations: number of azimuths, and of elevations up to the zenith, of the rays
    elevations: int = 9
    samples: int = 32  # number of voxels of each ray
    width: int = 256  # width of both networks
    layers: int = 8  # number of layers of the attenuation network


PUBLISHED = RaySize()

REDUCED = RaySize(azimuths=12, elevations=3, samples=8, width=64)  # without a GPU


REDUCED_BATCH = 32  # pairs of a transmitter and a receiver in a step, at the reduced size


def size_here() -> RaySize:
    """The published size if there is a GPU, and the reduced one otherwise."""
    return PUBLISHED if torch.cuda.is_available() else REDUCED


def published_adam(network: nn.Module) -> torch.optim.Adam:
    """The optimiser of NeRF²'s program for powers and channels."""
    return torch.optim.Adam(network.parameters(), lr=1e-3, weight_decay=5e-5)


class RaySignals(nn.Module):
    """Sums of what the voxels along the rays of each receiver send back, over all rays.

    With the voxels n along a ray, Δ apart, each ray brings

    ``h = Σ_n s_n e^{jφ_n} Π_{m≤n} e^{−δ_m Δ + j (ψ_m + 2πΔ/λ)}``

    The attenuation network predicts (δ, ψ) and a feature of each voxel, the radiance network the signal (s, φ) that it
    sends back along the ray, from the feature, the direction and what is known of the transmitter.
    """

    places: Tensor
    directions: Tensor

    def __init__(
        self,
        receivers: Float[np.ndarray, "R 3"],
        inputs: int,
        far: float,
        unit: float,
        wavelength: float,
        size: RaySize,
        frequencies: int = 1,
    ):
        super().__init__()
        self.step = far / (size.samples - 1)
        self.advance = 2 * math.pi * math.fmod(self.step / wavelength, 1)
        rays = ray_directions(size.azimuths, size.elevations)
        reach = np.linspace(0, far, size.samples)
        voxels = receivers[:, None, None] + reach[:, None] * rays[:, None]  # [R, rays, samples, 3]
        self.register_buffer("places", octaves(torch.from_numpy(voxels / unit).float()))
        self.register_buffer("directions", octaves(torch.from_numpy(rays).float())[:, None])
        encoded = self.places.shape[-1]
        self.field = RadianceField(encoded, encoded + inputs, size.width, size.layers, frequencies)

    def forward(self, known: Float[Tensor, "B #R inputs"]) -> Float[Tensor, "B R S 2"]:
        """Received signals (real, imaginary) of each receiver and subcarrier."""
        attenuation, feature = self.field.voxels(self.places)
        signal = self.field.signals(feature, self.directions, known[:, :, None, None])
        delta, psi = attenuation.chunk(2, dim=-1)
        amplitude, phi = signal.chunk(2, dim=-1)  # [B, R, rays, samples, S]
        left = torch.exp(-(delta.abs() * self.step).cumsum(-2))
        phase = (2 * math.pi * psi.sigmoid() - math.pi + self.advance).cumsum(-2) + 2 * math.pi * phi.sigmoid()
        amplitude = amplitude.abs() * left
        return torch.stack([each.sum((-3, -2)) for each in (amplitude * phase.cos(), amplitude * phase.sin())], dim=-1)


def ray_directions(azimuths: int, elevations: int) -> Float[np.ndarray, "rays 3"]:
    """Unit vectors at equally spaced azimuths, for each of equally spaced elevations above the horizon, up to 90°."""
    azimuth = np.arange(azimuths) * 2 * np.pi / azimuths
    elevation = np.arange(1, elevations + 1)[:, None] * np.pi / 2 / elevations
    across = np.cos(elevation)
    up = np.broadcast_to(np.sin(elevation), (elevations, azimuths))
    return np.stack([across * np.cos(azimuth), across * np.sin(azimuth), up], axis=-1).reshape(-1, 3)


def octaves(coordinates: Float[Tensor, "*batch 3"]) -> Float[Tensor, "*batch encoded"]:
    """The encoding of NeRF²'s program: its octaves are sin(2^k t) and cos(2^k t), without the π of γ."""
    return positional_encoding(coordinates / math.pi, ORDER)


FAR = 5.0  # distance from the gateway to a ray's last voxel, metres
PATH_LOSS = 0.025  # λ / 4π at 915 MHz, metres
RAYS_AT_ONCE = 2048  # number of rays that a prediction marches at a time


class NeRF2(SpectrumModel):
    """NeRF² [zhao2023]: voxels along rays send signals back to the gateway, and attenuate and delay those behind them.

    With the voxels n along the ray in direction ω, the spectrum is the magnitude of

    ``R(ω) = Σ_n PATH_LOSS / r_n · Π_{j<n} e^{−δ_j Δr + jψ_j Δr} · s_n e^{jφ_n}``

    The attenuation network predicts (δ, ψ) and a feature of each voxel. The radiance network predicts the signal (s, φ)
    that the voxel sends back along the ray, from the feature, the direction and the transmitter's position.
    """

    directions: Tensor
    pixels: Tensor
    rows: Tensor
    columns: Tensor

    def __init__(
        self,
        region: Region,
        beamformer: Beamformer,
        wavelength: float,
        *,
        samples: int = 64,
        rays: int = 8192,
        width: int = 256,
        layers: int = 8,
    ):
        require_whole(2, OPTION_MOST, samples=samples)
        require_whole(4, OPTION_MOST, layers=layers)
        super().__init__(region, wavelength)
        self.samples, self.rays = samples, rays
        self.encoding = TransmitterEncoding("octaves", ORDER)
        pixels = picture_pixels(beamformer)
        flat = torch.from_numpy((pixels.rows[:, None] * COLUMNS + pixels.columns).ravel())
        directions = torch.from_numpy(beamformer.grid.directions).float().flatten(0, 1)[flat]
        self.register_buffer("pixels", flat, persistent=False)
        self.register_buffer("directions", directions, persistent=False)
        for name, matrix in zip(("rows", "columns"), interpolation(pixels), strict=True):
            self.register_buffer(name, torch.from_numpy(matrix).float(), persistent=False)
        encoded = 3 * (2 * ORDER + 1)
        self.field = RadianceField(encoded, encoded + self.encoding.size, width, layers)

    def voxels(
        self, directions: Float[Tensor, "R 3"]
    ) -> tuple[Float[Tensor, "R samples 2"], Float[Tensor, "R samples width"]]:
        """Outputs of the attenuation network for the voxels along rays. They do not depend on the transmitter."""
        radius = torch.linspace(0, FAR, self.samples, device=directions.device)
        encoded = positional_encoding(directions[:, None] * radius[:, None] / FAR, ORDER)
        return self.field.voxels(encoded)

    def received(
        self,
        directions: Float[Tensor, "R 3"],
        attenuation: Float[Tensor, "R samples 2"],
        feature: Float[Tensor, "R samples width"],
        transmitters: Float[Tensor, "B size"],
    ) -> Float[Tensor, "B R"]:
        """Received magnitude ``|R|`` of each ray, for each transmitter."""
        encoded = positional_encoding(directions, ORDER)[:, None]
        signal = self.field.signals(feature, encoded, transmitters[:, None, None])
        step = FAR / (self.samples - 1)
        loss, phase_shift = attenuation[..., 0].abs() * step, attenuation[..., 1].sigmoid() * 2 * math.pi * step
        # Only voxels j < n attenuate and delay the signal of voxel n.
        transmittance = torch.exp(loss - loss.cumsum(-1))
        phase = phase_shift.cumsum(-1) - phase_shift + signal[..., 1].sigmoid() * 2 * math.pi
        radius = step * torch.arange(1, self.samples + 1, device=signal.device)
        amplitude = PATH_LOSS / radius * transmittance * signal[..., 0].abs()
        real, imaginary = (amplitude * phase.cos()).sum(-1), (amplitude * phase.sin()).sum(-1)
        return (real**2 + imaginary**2).clamp_min(1e-20).sqrt()

    def marched(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B h w"]:
        """Magnitudes at the pixels that have rays; the voxels are computed once for all transmitters."""
        transmitters = self.encoding(positions, self.region, self.wavelength)
        at_once = max(1, RAYS_AT_ONCE // len(positions))
        magnitudes = [self.received(each, *self.voxels(each), transmitters) for each in self.directions.split(at_once)]
        return torch.cat(magnitudes, dim=1).unflatten(1, (self.rows.shape[1], self.columns.shape[1]))

    def forward(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B 90 360"]:
        return (self.rows @ self.marched(positions) @ self.columns.T).clamp(0, 1)

    def training_loss(self, positions: Float[Tensor, "B 3"], spectra: Float[Tensor, "B 90 360"]) -> Float[Tensor, ""]:
        """Mean squared error at some of the pixels that have rays, drawn at random, the same for all spectra."""
        count = min(max(1, self.rays // len(positions)), len(self.directions))
        drawn = torch.randperm(len(self.directions), device=positions.device)[:count]
        directions = self.directions[drawn]
        magnitude = self.received(
            directions, *self.voxels(directions), self.encoding(positions, self.region, self.wavelength)
        )
        return (magnitude - spectra.flatten(1)[:, self.pixels[drawn]]).square().mean()
