"""Cross-attention over the spectra of the nearest known transmitters, trained in other rooms.

This follows the principle of GRaF [yang2026] as its abstract describes it: the spectrum at a position is near those at
the neighbouring positions, so a network attends to the neighbours' spectra by their relative places and learns from
many rooms how to combine them. It is our own network, not the authors' code. It is smaller, and it decodes each
direction from one latent vector, where GRaF sums latent voxels along the ray.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float, Int
from scipy.spatial.transform import Rotation
from torch import Tensor, nn
from torch.nn.functional import avg_pool2d, pad

from simulate.dataset.dataset import Dataset
from simulate.spectra.angular_grid import COLUMNS, ROWS

POOLED = 6
"""Pixels along each side of a coarse one, at which the network works. A 4 × 4 array tells directions 25° apart."""


@dataclass(frozen=True)
class RoomTensors:
    """A room's spectra as the network takes them."""

    places: Float[Tensor, "K 3"]  # transmitter positions relative to the gateway, wavelengths, gateway frame
    pictures: Float[Tensor, "K H W"]  # coarse spectra, 0…1
    directions: Float[Tensor, "H W 3 3"]  # unit vectors of the coarse pixels, and of their two tangents, gateway frame

    @classmethod
    def of(cls, dataset: Dataset, used: Int[np.ndarray, " K"]) -> RoomTensors:
        """Those of some spectra of a dataset."""
        pictures = torch.from_numpy(dataset.spectra[used]).float()
        middle = dataset.grid.directions[POOLED // 2 :: POOLED, POOLED // 2 :: POOLED]
        azimuth = np.cross([0.0, 0.0, 1.0], middle)
        azimuth /= np.linalg.norm(azimuth, axis=-1, keepdims=True)
        frame = np.stack([middle, azimuth, np.cross(middle, azimuth)], axis=-2)
        return cls(local_places(dataset, dataset.positions[used]), pooled(pictures), torch.from_numpy(frame).float())


def local_places(dataset: Dataset, positions: Float[np.ndarray, "K 3"]) -> Float[Tensor, "K 3"]:
    """Positions relative to the gateway, wavelengths, gateway frame."""
    turned = Rotation.from_quat(dataset.gateway_orientation).inv().apply(positions - dataset.gateway_position)
    return torch.from_numpy(turned / dataset.wavelength).float()


def pooled(spectra: Float[Tensor, "K 90 360"]) -> Float[Tensor, "K H W"]:
    """Spectra averaged over squares of pixels."""
    return avg_pool2d(spectra[:, None], POOLED)[:, 0]


class NeighbourAttention(nn.Module):
    """Weights of the neighbours' spectra in every direction, and a correction.

    Every coarse direction attends to the neighbours twice. The keys and values of a neighbour are features of its
    spectrum around this direction, and its relative place in the frame of the direction. Before training, the weights
    are those of inverse distance.
    """

    def __init__(self, width: int = 32, heads: int = 4):
        super().__init__()
        self.heads = heads
        self.look = nn.Sequential(_Around(1, 16), nn.GELU(), _Around(16, 16))
        self.neighbour = nn.Sequential(nn.Linear(16 + 1 + 5 + 3, width), nn.GELU(), nn.Linear(width, width))
        self.first = nn.Sequential(nn.Linear(16 + 1 + 3, width), nn.GELU(), nn.Linear(width, width))
        self.key, self.value = nn.Linear(width, width), nn.Linear(width, width)
        self.latent = nn.Sequential(nn.Linear(2 * width, width), nn.GELU(), nn.Linear(width, width))
        self.second = nn.Linear(width, width)
        self.key_again = nn.Linear(width, width)
        self.sharpness = nn.Parameter(torch.tensor(1.0))
        self.correction = nn.Linear(width, 1)
        for layer in (self.second, self.correction):
            nn.init.zeros_(layer.weight)
            nn.init.zeros_(layer.bias)

    def forward(
        self,
        target: Float[Tensor, "B 3"],
        places: Float[Tensor, "B L 3"],
        pictures: Float[Tensor, "B L H W"],
        directions: Float[Tensor, "H W 3 3"],
    ) -> tuple[Float[Tensor, "B L H W"], Float[Tensor, "B H W"]]:
        """The weights of the neighbours, which add up to 1, and the correction of their mean."""
        looked = self.look(pictures.flatten(0, 1)[:, None]).unflatten(0, pictures.shape[:2])
        seen = torch.cat([looked, pictures[:, :, None]], dim=2)
        seen = seen.permute(0, 3, 4, 1, 2)  # B H W L features
        apart = target[:, None] - places
        distance = apart.norm(dim=-1).clamp(min=1e-3)
        nearer = (-distance.log()).log_softmax(dim=-1)[:, None, None]  # weights of inverse distance
        turned = torch.einsum("hwij,blj->bhwli", directions, apart)
        of_all = torch.stack([distance, distance.log()], dim=-1)[:, None, None].expand(*turned.shape[:-1], 2)
        bearing = torch.einsum("hwij,bj->bhwi", directions, target / target.norm(dim=-1, keepdim=True))
        mean = (nearer.exp()[..., None] * seen).sum(dim=-2)
        bearings = bearing[..., None, :].expand(*turned.shape[:-1], 3)
        features = self.neighbour(torch.cat([seen, turned, of_all, bearings], dim=-1))
        query = self.first(torch.cat([mean, bearing], dim=-1))
        weights = (self._match(query, self.key(features)) + nearer[..., None]).softmax(dim=-2)
        values = self.value(features).unflatten(-1, (self.heads, -1))
        found = (weights[..., None] * values).sum(dim=-3).flatten(-2)
        latent = self.latent(torch.cat([query, found], dim=-1))
        again = self._match(self.second(latent), self.key_again(features)).mean(dim=-1)
        shares = (again + self.sharpness * nearer).softmax(dim=-1)
        return shares.permute(0, 3, 1, 2), self.correction(latent)[..., 0]

    def _match(
        self, query: Float[Tensor, "B H W F"], key: Float[Tensor, "B H W L F"]
    ) -> Float[Tensor, "B H W L heads"]:
        """Products of queries and keys of each head."""
        product = (query[..., None, :] * key).unflatten(-1, (self.heads, -1)).sum(dim=-1)
        return product / (key.shape[-1] // self.heads) ** 0.5


class _Around(nn.Conv2d):
    """A convolution of 3 × 3 that is periodic in azimuth."""

    def __init__(self, inputs: int, outputs: int):
        super().__init__(inputs, outputs, 3)

    def forward(self, pictures: Tensor) -> Tensor:
        return super().forward(pad(pad(pictures, (1, 1, 0, 0), mode="circular"), (0, 0, 1, 1)))


def to_all_pixels(coarse: Float[Tensor, "B L H W"]) -> Float[Tensor, "B L 90 360"]:
    """Linear interpolation, periodic in azimuth."""
    wrapped = pad(coarse, (1, 1, 0, 0), mode="circular")
    fine = nn.functional.interpolate(wrapped, (ROWS, COLUMNS + 2 * POOLED), mode="bilinear")
    return fine[..., POOLED:-POOLED]
