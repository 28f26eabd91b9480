"""The gateway's planar array: element positions and array manifold.

The gateway frame is that of ``simulate.spectra.angular_grid``. All lengths here are in wavelengths, so the wavenumber
k = 2π/λ is 2π.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np
from jaxtyping import Complex, Float
from msgspec import Meta

from scenes.files.array_argument import check_array
from scenes.files.errors import ParameterError, require_positive, require_whole, require_within
from scenes.files.options import check_kinds
from scenes.scene.description import MOST_ELEMENTS, MOST_IN_A_ROW, WIDEST_SPACING, Gateway
from simulate.spectra.angular_grid import direction


@dataclass(frozen=True)
class PlanarArray:
    """Uniform planar array of M × N elements in the gateway's x-y plane, centred on the gateway's position.

    Element m = row · columns + column has the position d_m (``positions``). So x runs fastest, as in NeRF²'s list of
    antenna positions [zhao2023].

    Attributes:
        rows: number M of elements along y.
        columns: number N of elements along x.
        spacing: distance between neighbouring elements, wavelengths.

    Raises:
        ParameterError: a number of elements is not 1 to 64, there are more than 1024 in all, or the spacing is not
            above 0 and at most 100 wavelengths.

    Example:
        The responses to a plane wave from azimuth 200° and elevation 40°:

        >>> import bisplat, numpy as np
        >>> array = bisplat.PlanarArray()
        >>> y = array.manifold(np.radians(200.0), np.radians(40.0))
        >>> y.shape, np.abs(y).round(6).max().item()
        ((16,), 1.0)
    """

    rows: Annotated[int, Meta(ge=1, le=MOST_IN_A_ROW)] = 4
    columns: Annotated[int, Meta(ge=1, le=MOST_IN_A_ROW)] = 4
    spacing: Annotated[float, Meta(gt=0, le=WIDEST_SPACING)] = 0.5

    def __post_init__(self) -> None:
        check_kinds(self)
        require_whole(1, MOST_IN_A_ROW, rows=self.rows, columns=self.columns)
        if self.elements > MOST_ELEMENTS:
            found = f"{self.rows} × {self.columns}"
            raise ParameterError("rows", f"expected at most {MOST_ELEMENTS} elements in all, found {found}")
        require_positive(spacing=self.spacing)
        require_within(0, WIDEST_SPACING, "wavelengths", spacing=self.spacing)

    @classmethod
    def of(cls, gateway: Gateway) -> PlanarArray:
        """The array of a gateway.

        Args:
            gateway: the gateway of a scene.

        Returns:
            The array with the gateway's rows, columns and spacing.
        """
        return cls(gateway.rows, gateway.columns, gateway.spacing)

    @property
    def elements(self) -> int:
        """Number of elements, MN."""
        return self.rows * self.columns

    @cached_property
    def positions(self) -> Float[np.ndarray, "elements 3"]:
        """Position d_m of each element, wavelengths, gateway frame, [elements, 3].

        Example:
            >>> import bisplat
            >>> bisplat.PlanarArray(rows=1, columns=2).positions.tolist()
            [[-0.25, 0.0, 0.0], [0.25, 0.0, 0.0]]
        """
        x = (np.arange(self.columns) - (self.columns - 1) / 2) * self.spacing
        y = (np.arange(self.rows) - (self.rows - 1) / 2) * self.spacing
        grid_y, grid_x = np.meshgrid(y, x, indexing="ij")
        return np.stack([grid_x.ravel(), grid_y.ravel(), np.zeros(self.elements)], axis=-1)

    def manifold(
        self, azimuth: Float[np.ndarray, "*shape"], elevation: Float[np.ndarray, "*shape"]
    ) -> Complex[np.ndarray, "*shape elements"]:
        """Array manifold: the response of each element to a plane wave.

        Element m has the response a_m(φ, θ) = e^{+jk u·d_m} to a wave that arrives from the unit vector u(φ, θ)
        ([vantrees2002], chapter 2). The sign follows from the convention e^{−j2πfτ} for a delay τ: an element nearer
        the source has the larger phase.

        Args:
            azimuth: φ, radians, gateway frame; a number or an array.
            elevation: θ, radians, gateway frame; broadcast against ``azimuth``.

        Returns:
            Complex responses of magnitude 1, [..., elements].

        Raises:
            ParameterError: an angle is not a finite number, or the shapes cannot be broadcast.

        Example:
            A wave from the boresight reaches all elements at the same time:

            >>> import bisplat, numpy as np
            >>> y = bisplat.PlanarArray(rows=1, columns=2).manifold(np.array([0.0, 0.0]), np.radians([90.0, 0.0]))
            >>> np.degrees(np.angle(y)).round().tolist()
            [[-0.0, 0.0], [-90.0, 90.0]]
        """
        return np.exp(2j * np.pi * direction(azimuth, elevation) @ self.positions.T)

    def angle_between(
        self, u: Float[np.ndarray, "*batch 3"], v: Float[np.ndarray, "*batch 3"]
    ) -> Float[np.ndarray, "*batch"]:
        """The angle between directions, as far as the array can tell them apart.

        It is the great-circle angle ``arccos(u·v)``. A line of elements along an axis a tells only the angle to this
        axis, since its manifold is the same all along a cone. For a line it is ``|arccos(a·u) − arccos(a·v)|``.

        Args:
            u: unit vectors [..., 3], gateway frame.
            v: unit vectors [..., 3], gateway frame.

        Returns:
            Degrees, [...].

        Example:
            Two directions at right angles to a line along x:

            >>> import bisplat, numpy as np
            >>> u, v = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])
            >>> line = bisplat.PlanarArray(rows=1, columns=8)
            >>> float(line.angle_between(u, v)), float(bisplat.PlanarArray().angle_between(u, v))
            (0.0, 90.0)
        """
        u, v = (check_array(name, given, (..., 3), "unit vectors") for name, given in (("u", u), ("v", v)))
        if min(self.rows, self.columns) > 1:
            return np.degrees(np.arccos(np.clip((u * v).sum(-1), -1, 1)))
        axis = 0 if self.rows == 1 else 1  # columns are along x, rows along y
        return np.degrees(np.abs(np.arccos(np.clip(u[..., axis], -1, 1)) - np.arccos(np.clip(v[..., axis], -1, 1))))
