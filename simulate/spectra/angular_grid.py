"""The directions a spectrum is sampled at, and the unit vector of a direction.

Gateway frame: the array lies in the local x-y plane, boresight +z. φ is azimuth, θ elevation above the array plane
(θ = 90° is boresight).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np
from jaxtyping import Float
from msgspec import Meta

ROWS, COLUMNS = 90, 360
"""Size of every spectrum: elevations and azimuths."""


@dataclass(frozen=True)
class AngularGrid:
    """The directions of a spectrum's 90 rows and 360 columns. The defaults are those of NeRF²'s measured pictures.

    Attributes:
        elevation_first_deg: elevation of row 0, degrees.
        elevation_step_deg: from row to row, degrees.
        azimuth_step_deg: from column to column, degrees; column 0 is azimuth 0°.

    >>> grid = AngularGrid()
    >>> grid.elevations_deg[[0, -1]].tolist(), grid.azimuths_deg[[0, -1]].tolist()
    ([0.0, 89.0], [0.0, 359.0])
    """

    elevation_first_deg: Annotated[float, Meta(ge=-360, le=360)] = 0.0
    elevation_step_deg: Annotated[float, Meta(gt=0, le=360)] = 1.0
    azimuth_step_deg: Annotated[float, Meta(gt=0, le=360)] = 1.0

    @cached_property
    def elevations_deg(self) -> Float[np.ndarray, " 90"]:
        """Elevation θ of each row."""
        return self.elevation_first_deg + self.elevation_step_deg * np.arange(ROWS)

    @cached_property
    def azimuths_deg(self) -> Float[np.ndarray, " 360"]:
        """Azimuth φ of each column."""
        return self.azimuth_step_deg * np.arange(COLUMNS)

    @cached_property
    def directions(self) -> Float[np.ndarray, "90 360 3"]:
        """Unit vector of each pixel, gateway frame."""
        return direction(np.radians(self.azimuths_deg), np.radians(self.elevations_deg)[:, None])

    def dominant_angles(self, spectrum: Float[np.ndarray, "*batch 90 360"]) -> Float[np.ndarray, "*batch 2"]:
        """Azimuth and elevation of each spectrum's maximum, degrees.

        Args:
            spectrum: magnitude, power, or normalised.

        >>> spectrum = np.zeros((90, 360))
        >>> spectrum[40, 200] = 1
        >>> AngularGrid().dominant_angles(spectrum).tolist()
        [200.0, 40.0]
        """
        flat = spectrum.reshape(*spectrum.shape[:-2], -1).argmax(axis=-1)
        row, column = np.unravel_index(flat, (ROWS, COLUMNS))
        return np.stack([self.azimuths_deg[column], self.elevations_deg[row]], axis=-1)

    def dominant_direction(self, spectrum: Float[np.ndarray, "*batch 90 360"]) -> Float[np.ndarray, "*batch 3"]:
        """The direction of each spectrum's maximum: the dominant path's angle of arrival.

        Args:
            spectrum: magnitude, power, or normalised.

        Returns:
            Unit vectors, gateway frame.
        """
        azimuth, elevation = np.moveaxis(np.radians(self.dominant_angles(spectrum)), -1, 0)
        return direction(azimuth, elevation)


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
