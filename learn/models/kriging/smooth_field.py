"""Kriging of spectra where known positions are too far apart to follow the waves between them."""

from __future__ import annotations

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from learn.models.kriging.kriged_field import KrigedField
from learn.models.kriging.wave_covariance import Separations
from simulate.spectra.beamformer import Beamformer


class SmoothField(KrigedField):
    """Kriging of spectra by the squared exponential ``e^(−|Δ|²/2ℓ²)``, without waves.

    Where known positions are many wavelengths apart, nothing can follow the waves between them. The spectra's slow
    change over metres can still be interpolated.
    """

    neighbours = 64

    def __init__(self, region: Float[np.ndarray, "2 3"], beamformer: Beamformer, wavelength: float):
        super().__init__(region, beamformer, wavelength, "spectra")

    @property
    def first_length(self) -> float:
        """A tenth of the known positions' largest extent, but at least 0.1 mm; in metres."""
        return max(float((self.places.amax(dim=0) - self.places.amin(dim=0)).max()), 1e-3) / 10

    def kappa(
        self,
        separations: Separations,
        fading: Float[Tensor, "*b n m"],
        shares: Float[Tensor, " J"],
        length: Float[Tensor, ""],
    ) -> tuple[Float[Tensor, "*b n m"], None]:
        """The squared exponential, times the drift's factor."""
        return torch.exp(-(separations.distances / length).square() / 2) * fading, None
