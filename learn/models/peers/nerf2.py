"""NeRF² [zhao2023]: rays are marched from the gateway through a radiance field, one for each pixel.

Only the few pixels that hold the array's band have rays; the spectrum is interpolated from these. The model is written
from the paper's equations; differences from the published code are in the documentation, Other authors' models.
"""

from __future__ import annotations

import math

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from learn.models.base import SpectrumModel
from learn.models.encoding import EncodingKind, TransmitterEncoding, positional_encoding
from learn.models.model_settings import OPTION_MOST
from learn.models.peers.ray_signals import RadianceField
from learn.models.quadrature import interpolation, picture_pixels
from scenes.files.errors import require_whole
from simulate.spectra.angular_grid import COLUMNS
from simulate.spectra.beamformer import Beamformer

ORDER = 10  # number of octaves of all three encodings
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
        region: Float[np.ndarray, "2 3"],
        beamformer: Beamformer,
        wavelength: float,
        *,
        samples: int = 64,
        rays: int = 8192,
        width: int = 256,
        layers: int = 8,
        encoding: EncodingKind = "octaves",
    ):
        require_whole(2, OPTION_MOST, samples=samples)
        require_whole(4, OPTION_MOST, layers=layers)
        super().__init__(region, wavelength)
        self.samples, self.rays = samples, rays
        self.encoding = TransmitterEncoding(encoding, ORDER)
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
        transmitters = self.encoded(positions)
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
        magnitude = self.received(directions, *self.voxels(directions), self.encoded(positions))
        return (magnitude - spectra.flatten(1)[:, self.pixels[drawn]]).square().mean()
