"""The methods that predict responses over a band, by name."""

from __future__ import annotations

from collections.abc import Callable

from learn.band.band_baselines import InverseDistance, Nearest
from learn.band.band_kriging import HelmholtzBand, Kriging
from learn.band.known_band import BandMethod
from learn.band.learned_band import ApertureBand, ResponseMLPBand

BAND_METHODS: dict[str, Callable[[], BandMethod]] = {
    "nearest": Nearest,
    "inverse-distance": InverseDistance,
    "kriging": Kriging,
    "helmholtz": HelmholtzBand,
    "mlp-responses": ResponseMLPBand,
    "bisplat-aperture": ApertureBand,
}
"""Functions that make new, unfitted methods."""
