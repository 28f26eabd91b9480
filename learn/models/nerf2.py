"""NeRF² (Zhao et al., MobiCom 2023): a spectrum's pixels by marching rays from the gateway through a radiance field.

Written from the paper's equations; docs/peers.md says what differs from the published code.
"""

from __future__ import annotations

import math

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor, nn

from learn.models.base import SpectrumModel
from learn.models.encoding import positional_encoding
from learn.models.networks import LinearOfParts
from simulate.angular_grid import AZIMUTHS_DEG, ELEVATIONS_DEG
from simulate.array import PlanarArray

ORDER = 10
"""Octaves of all three encodings."""

FAR = 5.0
"""Metres from the gateway to a ray's last voxel."""

PATH_LOSS = 0.025
"""λ / 4π at 915 MHz, metres."""

RAYS_AT_ONCE = 2048


class NeRF2(SpectrumModel):
    """R(ω) = Σ_n PATH_LOSS / r_n · Π_{j<n} e^{−δ_j Δr + jψ_j Δr} · s_n e^{jφ_n}, S = |R|, voxels n along the ray ω.

    The attenuation network gives (δ, ψ) and a feature of each voxel; the radiance network turns feature, direction and
    transmitter position into the signal (s, φ) the voxel sends back along the ray.

    Args:
        region: as ``SpectrumModel``.
        array: the gateway's array; this model does not use it.
        samples: voxels per ray.
        rays: rays per training step, drawn from all of the batch's pixels.
        width: of both networks.
        layers: of the attenuation network.
    """

    directions: Tensor

    def __init__(
        self,
        region: Float[np.ndarray, "2 3"],
        array: PlanarArray,
        samples: int = 64,
        rays: int = 8192,
        width: int = 256,
        layers: int = 8,
    ):
        super().__init__(region)
        self.samples, self.rays = samples, rays
        elevation, azimuth = np.meshgrid(np.radians(ELEVATIONS_DEG), np.radians(AZIMUTHS_DEG), indexing="ij")
        across = np.cos(elevation)
        directions = np.stack([across * np.cos(azimuth), across * np.sin(azimuth), np.sin(elevation)], axis=-1)
        self.register_buffer("directions", torch.from_numpy(directions.reshape(-1, 3)).float(), persistent=False)
        encoded = 3 * (2 * ORDER + 1)
        self.inward = nn.Linear(encoded, width)
        half = layers // 2
        self.first = nn.ModuleList(nn.Linear(width, width) for _ in range(half))
        self.skip = LinearOfParts(width + encoded, width)
        self.second = nn.ModuleList(nn.Linear(width, width) for _ in range(layers - half - 2))
        self.attenuation = nn.Linear(width, 2)
        self.feature = nn.Linear(width, width)
        self.radiance = LinearOfParts(width + 2 * encoded, width)
        self.signal = nn.Sequential(nn.ReLU(), nn.Linear(width, width // 2), nn.ReLU(), nn.Linear(width // 2, 2))

    def voxels(
        self, directions: Float[Tensor, "R 3"]
    ) -> tuple[Float[Tensor, "R samples 2"], Float[Tensor, "R samples width"]]:
        """Raw attenuations and features of the voxels along rays; the transmitter has no part in them."""
        radius = torch.linspace(0, FAR, self.samples, device=directions.device)
        encoded = positional_encoding(directions[:, None] * radius[:, None] / FAR, ORDER)
        x = self.inward(encoded).relu()
        for layer in self.first:
            x = layer(x).relu()
        x = self.skip(x, encoded).relu()
        for layer in self.second:
            x = layer(x).relu()
        return self.attenuation(x), self.feature(x)

    def received(
        self,
        directions: Float[Tensor, "R 3"],
        attenuation: Float[Tensor, "R samples 2"],
        feature: Float[Tensor, "R samples width"],
        transmitters: Float[Tensor, "#R 3"],
    ) -> Float[Tensor, " R"]:
        """|R| of each ray, each with its transmitter (positions scaled to −1…1)."""
        raw = self.signal(
            self.radiance(
                feature,
                positional_encoding(directions, ORDER)[:, None],
                positional_encoding(transmitters, ORDER)[:, None],
            )
        )
        step = FAR / (self.samples - 1)
        loss, turn = attenuation[..., 0].abs() * step, attenuation[..., 1].sigmoid() * 2 * math.pi * step
        # What lies nearer than voxel n: sums over j < n.
        transmittance = torch.exp(loss - loss.cumsum(-1))
        phase = turn.cumsum(-1) - turn + raw[..., 1].sigmoid() * 2 * math.pi
        radius = step * torch.arange(1, self.samples + 1, device=raw.device)
        amplitude = PATH_LOSS / radius * transmittance * raw[..., 0].abs()
        real, imaginary = (amplitude * phase.cos()).sum(-1), (amplitude * phase.sin()).sum(-1)
        return (real**2 + imaginary**2).clamp_min(1e-20).sqrt()

    def loss(self, positions: Float[Tensor, "B 3"], spectra: Float[Tensor, "B 90 360"]) -> Float[Tensor, ""]:
        """Mean squared error of random rays of the batch."""
        which = torch.randint(len(positions), (self.rays,), device=positions.device)
        pixel = torch.randint(len(self.directions), (self.rays,), device=positions.device)
        directions = self.directions[pixel]
        found = self.received(directions, *self.voxels(directions), self.scaled(positions)[which])
        return (found - spectra.flatten(1)[which, pixel]).square().mean()

    def forward(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B 90 360"]:
        """Predicted spectra; voxels are computed once for all transmitters."""
        scaled = self.scaled(positions)
        pieces = []
        for directions in self.directions.split(RAYS_AT_ONCE):
            attenuation, feature = self.voxels(directions)
            pieces.append(torch.stack([self.received(directions, attenuation, feature, one[None]) for one in scaled]))
        return torch.cat(pieces, dim=1).unflatten(1, (len(ELEVATIONS_DEG), len(AZIMUTHS_DEG)))
