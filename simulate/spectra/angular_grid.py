"""The directions at which a spectrum is sampled, in the gateway frame: azimuth φ from +x, elevation θ above x–y."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np
from jaxtyping import Float
from msgspec import Meta

from scenes.files.errors import ParameterError, check_array, require_within
from scenes.files.options import check_kinds

ROWS, COLUMNS = 90, 360  # Size of every spectrum: number of elevations, number of azimuths


@dataclass(frozen=True)
class AngularGrid:
    """The directions of a spectrum's 90 rows and 360 columns.

    Directions are given in the gateway frame: the array lies in the x-y plane and its boresight is +z. The azimuth φ
    runs from +x towards +y. The elevation θ is measured from the array plane, so 90° is the boresight.

    The defaults are the grid of NeRF²'s measured pictures [zhao2023]: row 0 is the horizon, and row 89 lies 1° below
    the boresight.

    Attributes:
        elevation_first_deg: elevation of row 0, degrees.
        elevation_step_deg: step from one row to the next, degrees; negative if the pictures are upside down.
        azimuth_step_deg: step from one column to the next, degrees. Column 0 is azimuth 0°.

    Raises:
        ParameterError: a number is not within ±360 degrees, or a step is 0.

    Example:
        >>> import bisplat
        >>> grid = bisplat.AngularGrid()
        >>> grid.elevations_deg[[0, -1]].tolist(), grid.azimuths_deg[[0, -1]].tolist()
        ([0.0, 89.0], [0.0, 359.0])
    """

    elevation_first_deg: Annotated[float, Meta(ge=-360, le=360)] = 0.0
    elevation_step_deg: Annotated[float, Meta(gt=0, le=360)] = 1.0
    azimuth_step_deg: Annotated[float, Meta(gt=0, le=360)] = 1.0

    def __post_init__(self) -> None:
        check_kinds(self)
        require_within(-360, 360, "degrees", **vars(self))
        for name in ("elevation_step_deg", "azimuth_step_deg"):
            if getattr(self, name) == 0:
                raise ParameterError(name, "expected a step that is not 0, found 0")

    @cached_property
    def elevations_deg(self) -> Float[np.ndarray, " 90"]:
        """Elevation θ of each row, degrees, [90]."""
        return self.elevation_first_deg + self.elevation_step_deg * np.arange(ROWS)

    @cached_property
    def azimuths_deg(self) -> Float[np.ndarray, " 360"]:
        """Azimuth φ of each column, degrees, [360]."""
        return self.azimuth_step_deg * np.arange(COLUMNS)

    @cached_property
    def directions(self) -> Float[np.ndarray, "90 360 3"]:
        """Unit vector of each pixel's direction, gateway frame, [90, 360, 3].

        The vector of azimuth φ and elevation θ is u = (cos θ cos φ, cos θ sin φ, sin θ).
        """
        return direction(np.radians(self.azimuths_deg), np.radians(self.elevations_deg)[:, None])

    def dominant_angles(self, spectrum: Float[np.ndarray, "*batch 90 360"]) -> Float[np.ndarray, "*batch 2"]:
        """Azimuth and elevation of each spectrum's maximum.

        Args:
            spectrum: one spectrum [90, 360], or a stack of them [..., 90, 360]; magnitude, power, or normalised.

        Returns:
            Azimuth and elevation, degrees, gateway frame, [..., 2].

        Raises:
            ParameterError: the array has another shape, or does not hold real numbers.

        Example:
            >>> import bisplat, numpy as np
            >>> spectrum = np.zeros((90, 360))
            >>> spectrum[40, 200] = 1
            >>> bisplat.AngularGrid().dominant_angles(spectrum).tolist()
            [200.0, 40.0]
        """
        spectrum = check_array("spectrum", spectrum, (..., ROWS, COLUMNS), "spectra [..., 90, 360]", finite=False)
        flat = spectrum.reshape(*spectrum.shape[:-2], -1).argmax(axis=-1)
        row, column = np.unravel_index(flat, (ROWS, COLUMNS))
        return np.stack([self.azimuths_deg[column], self.elevations_deg[row]], axis=-1)

    def dominant_direction(self, spectrum: Float[np.ndarray, "*batch 90 360"]) -> Float[np.ndarray, "*batch 3"]:
        """Unit vector towards each spectrum's maximum: the direction that the dominant path arrives from.

        Args:
            spectrum: one spectrum [90, 360], or a stack of them [..., 90, 360]; magnitude, power, or normalised.

        Returns:
            Unit vectors, gateway frame, [..., 3].

        Raises:
            ParameterError: the array has another shape, or does not hold real numbers.

        Example:
            >>> import bisplat, numpy as np
            >>> spectrum = np.zeros((90, 360))
            >>> spectrum[30, 0] = 1
            >>> bisplat.AngularGrid().dominant_direction(spectrum).round(3).tolist()
            [0.866, 0.0, 0.5]
        """
        azimuth, elevation = np.moveaxis(np.radians(self.dominant_angles(spectrum)), -1, 0)
        return direction(azimuth, elevation)


def direction(
    azimuth: Float[np.ndarray, "*shape"], elevation: Float[np.ndarray, "*shape"]
) -> Float[np.ndarray, "*shape 3"]:
    """Unit vector of a direction of arrival, u(φ, θ) = (cos θ cos φ, cos θ sin φ, sin θ), in the gateway frame."""
    azimuth = check_array("azimuth", azimuth, (...,), "angles in radians")
    elevation = check_array("elevation", elevation, (...,), "angles in radians")
    try:
        azimuth, elevation = np.broadcast_arrays(azimuth, elevation)
    except ValueError:
        found = f"found shapes {azimuth.shape} and {elevation.shape}"
        raise ParameterError("elevation", f"expected the shape of azimuth, or one that fits it, {found}") from None
    return np.stack(
        [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)], axis=-1
    )
