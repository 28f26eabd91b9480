"""The gateway's planar array: element positions, array manifold, and beamforming of responses to a spatial spectrum.

Gateway frame as in ``simulate.angular_grid``. k = 2π/λ; every length is in wavelengths here, so k = 2π.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Complex, Float

from scenes.description import Gateway
from simulate.angular_grid import AZIMUTHS_DEG, ELEVATIONS_DEG, direction

LEAST_POWER_DB = -200.0
"""Lowest value of a power spectrum, given where the power is zero: far below any receiver's noise."""


@dataclass(frozen=True)
class PlanarArray:
    """M × N uniform planar array in the gateway's x-y plane, centred on the gateway's position.

    Element m = row · columns + column sits at d_m, x running fastest, as NeRF²'s list of antenna positions does.

    Attributes:
        rows: number of elements along y.
        columns: number of elements along x.
        spacing: distance between neighbours in wavelengths.

    >>> array = PlanarArray()
    >>> y = array.manifold(np.radians(200.0), np.radians(40.0))  # a plane wave from azimuth 200°, elevation 40°
    >>> y.shape, array.spectrum(y).shape
    ((16,), (90, 360))
    """

    rows: int = 4
    columns: int = 4
    spacing: float = 0.5

    @classmethod
    def of(cls, gateway: Gateway) -> PlanarArray:
        """A gateway's array."""
        return cls(gateway.rows, gateway.columns, gateway.spacing)

    @property
    def elements(self) -> int:
        """Number of elements, MN."""
        return self.rows * self.columns

    @cached_property
    def positions(self) -> Float[np.ndarray, "elements 3"]:
        """d_m in wavelengths, gateway frame.

        >>> PlanarArray(rows=1, columns=2).positions.tolist()
        [[-0.25, 0.0, 0.0], [0.25, 0.0, 0.0]]
        """
        x = (np.arange(self.columns) - (self.columns - 1) / 2) * self.spacing
        y = (np.arange(self.rows) - (self.rows - 1) / 2) * self.spacing
        grid_y, grid_x = np.meshgrid(y, x, indexing="ij")
        return np.stack([grid_x.ravel(), grid_y.ravel(), np.zeros(self.elements)], axis=-1)

    def manifold(
        self, azimuth: Float[np.ndarray, "*shape"], elevation: Float[np.ndarray, "*shape"]
    ) -> Complex[np.ndarray, "*shape elements"]:
        """Array manifold: the response a_m(φ,θ) = e^{+jk u·d_m} of each element to a plane wave arriving from u.

        The sign is that of the e^{-j2πfτ} convention: an element nearer the source has the larger phase.

        Args:
            azimuth: φ in radians.
            elevation: θ in radians.

        Returns:
            The responses, of magnitude 1.
        """
        return np.exp(2j * np.pi * direction(azimuth, elevation) @ self.positions.T)

    @cached_property
    def steering(self) -> Complex[np.ndarray, "90 360 elements"]:
        """Steering vectors e^{-jk u·d_m} / √(MN) on the spectrum's grid: ``spectrum`` is |steering @ y|."""
        azimuth, elevation = np.meshgrid(np.radians(AZIMUTHS_DEG), np.radians(ELEVATIONS_DEG))
        return self.manifold(azimuth, elevation).conj() / np.sqrt(self.elements)

    def spectrum(self, responses: Complex[np.ndarray, "*batch elements"]) -> Float[np.ndarray, "*batch 90 360"]:
        """Spatial spectrum S(φ,θ) = |Σ_m y_m e^{-jk u·d_m}| / √(MN), a magnitude; power is S².

        Args:
            responses: complex element responses y.

        Returns:
            The spectrum, row 0 at 1° elevation.

        >>> y = PlanarArray().manifold(np.radians(200.0), np.radians(40.0))
        >>> peak = np.unravel_index(PlanarArray().spectrum(y).argmax(), (90, 360))
        >>> ELEVATIONS_DEG[peak[0]].item(), AZIMUTHS_DEG[peak[1]].item()
        (40, 200)
        """
        field = responses @ self.steering.reshape(-1, self.elements).T
        return np.abs(field).reshape(*responses.shape[:-1], len(ELEVATIONS_DEG), len(AZIMUTHS_DEG))

    def power_db(self, responses: Complex[np.ndarray, "*batch elements"]) -> Float[np.ndarray, "*batch 90 360"]:
        """Absolute power of the spatial spectrum, 10 log10 S², as a channel gain in dB; no less than −200 dB.

        0 dB is all of the transmitter's power received by one isotropic element. A plane wave of gain |y_m|² at every
        element peaks at 10 log10 MN above it, the array's gain; noise of the elements keeps its level.

        Args:
            responses: complex element responses y, un-normalised.

        Returns:
            The power in dB.

        >>> y = 1e-3 * PlanarArray().manifold(np.radians(200.0), np.radians(40.0))  # −60 dB at every element
        >>> PlanarArray().power_db(y).max().round(2).item()
        -47.96
        """
        return 20 * np.log10(np.maximum(self.spectrum(responses), 10 ** (LEAST_POWER_DB / 20)))
