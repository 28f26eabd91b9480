"""The directions a spectrum is sampled at, and the unit vector of a direction.

Gateway frame: the array lies in the local x-y plane, boresight +z. φ is azimuth, θ elevation above the array plane
(θ = 90° is boresight).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

AZIMUTHS_DEG = np.arange(360)
"""Columns of a spectrum: φ = 0…359°."""

ELEVATIONS_DEG = np.arange(1, 91)
"""Rows of a spectrum: θ = 1…90°; row 0 is 1°, the last row is boresight."""


@dataclass(frozen=True)
class AngularGrid:
    """The directions of a spectrum's 90 rows and 360 columns.

    Attributes:
        elevation_first_deg: elevation of row 0, degrees.
        elevation_step_deg: from row to row, degrees.
        azimuth_step_deg: from column to column, degrees; column 0 is azimuth 0°.

    >>> grid = AngularGrid()
    >>> grid.elevations_deg[[0, -1]].tolist(), grid.azimuths_deg[[0, -1]].tolist()
    ([0.0, 89.0], [0.0, 359.0])
    """

    elevation_first_deg: float = 0.0
    elevation_step_deg: float = 1.0
    azimuth_step_deg: float = 1.0

    @cached_property
    def elevations_deg(self) -> Float[np.ndarray, " 90"]:
        """Elevation of each row."""
        return self.elevation_first_deg + self.elevation_step_deg * np.arange(90)

    @cached_property
    def azimuths_deg(self) -> Float[np.ndarray, " 360"]:
        """Azimuth of each column."""
        return self.azimuth_step_deg * np.arange(360)


def direction(
    azimuth: Float[np.ndarray, "*shape"], elevation: Float[np.ndarray, "*shape"]
) -> Float[np.ndarray, "*shape 3"]:
    """Unit vector of a direction of arrival, u(φ,θ) = (cosθ cosφ, cosθ sinφ, sinθ), in the gateway frame.

    Args:
        azimuth: φ in radians.
        elevation: θ in radians.

    Returns:
        Unit vectors.

    >>> direction(np.radians(90.0), np.radians(0.0)).round(6).tolist()
    [0.0, 1.0, 0.0]
    """
    azimuth, elevation = np.broadcast_arrays(azimuth, elevation)
    return np.stack(
        [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)], axis=-1
    )
