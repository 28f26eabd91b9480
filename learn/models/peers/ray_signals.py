"""The networks of NeRF² [zhao2023], and its signals along all rays around one element, added up to a complex number."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor, nn

from learn.models.encoding import positional_encoding
from learn.models.networks.feed_forward import LinearOfParts


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


ORDER = 10  # number of octaves of the encodings of voxels and directions


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
