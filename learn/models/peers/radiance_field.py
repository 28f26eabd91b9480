"""The two networks of NeRF² [zhao2023]: what a voxel does to signals that pass it, and what it sends back itself."""

from __future__ import annotations

from jaxtyping import Float
from torch import Tensor, nn

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
        """Unconstrained attenuations and phase shifts of voxels, and their features. The transmitter plays no part."""
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
