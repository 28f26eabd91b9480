"""Beamforming: from the responses of an array's elements to a spatial spectrum on an angular grid.

Every dataset has one array and one grid; a ``Beamformer`` is the pair.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from jaxtyping import Complex, Float

from simulate.spectra.angular_grid import COLUMNS, ROWS, AngularGrid
from simulate.spectra.array import PlanarArray

LEAST_POWER_DB = -200.0
"""Lowest value of a power spectrum, given where the power is zero: far below any receiver's noise."""


@dataclass(frozen=True)
class Beamformer:
    """Steers an array to each direction of a grid.

    Attributes:
        array: the gateway's array.
        grid: the directions of the spectrum's pixels.

    >>> beamformer = Beamformer()
    >>> y = beamformer.array.manifold(np.radians(200.0), np.radians(40.0))  # a plane wave from azimuth 200°, elev. 40°
    >>> y.shape, beamformer.spectrum(y).shape
    ((16,), (90, 360))
    """

    array: PlanarArray = field(default_factory=PlanarArray)
    grid: AngularGrid = field(default_factory=AngularGrid)

    @cached_property
    def steering(self) -> Complex[np.ndarray, "90 360 elements"]:
        """Steering vectors e^{-jk u·d_m} / √(MN) of all pixels: ``spectrum`` is |steering @ y|."""
        azimuth, elevation = np.meshgrid(np.radians(self.grid.azimuths_deg), np.radians(self.grid.elevations_deg))
        return self.array.manifold(azimuth, elevation).conj() / np.sqrt(self.array.elements)

    def spectrum(self, responses: Complex[np.ndarray, "*batch elements"]) -> Float[np.ndarray, "*batch 90 360"]:
        """Spatial spectrum S(φ,θ) = |Σ_m y_m e^{-jk u·d_m}| / √(MN), a magnitude; power is S².

        Args:
            responses: complex element responses y.

        Returns:
            The spectrum on the grid.

        >>> beamformer = Beamformer()
        >>> y = beamformer.array.manifold(np.radians(200.0), np.radians(40.0))
        >>> beamformer.grid.dominant_angles(beamformer.spectrum(y)).tolist()
        [200.0, 40.0]
        """
        pixels = responses @ self.steering.reshape(-1, self.array.elements).T
        return np.abs(pixels).reshape(*responses.shape[:-1], ROWS, COLUMNS)

    def power_db(self, responses: Complex[np.ndarray, "*batch elements"]) -> Float[np.ndarray, "*batch 90 360"]:
        """Absolute power of the spatial spectrum, 10 log10 S², as a channel gain in dB; no less than −200 dB.

        0 dB is all of the transmitter's power received by one isotropic element. A plane wave of gain |y_m|² at every
        element peaks at 10 log10 MN above it, the array's gain; noise of the elements keeps its level.

        Args:
            responses: complex element responses y, un-normalised.

        Returns:
            The power in dB.

        >>> beamformer = Beamformer()
        >>> y = 1e-3 * beamformer.array.manifold(np.radians(200.0), np.radians(40.0))  # −60 dB at every element
        >>> beamformer.power_db(y).max().round(2).item()
        -47.96
        """
        return 20 * np.log10(np.maximum(self.spectrum(responses), 10 ** (LEAST_POWER_DB / 20)))
