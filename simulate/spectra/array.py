"""The gateway's planar array: element positions and array manifold.

Gateway frame as in ``simulate.spectra.angular_grid``. k = 2π/λ; every length is in wavelengths here, so k = 2π.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np
from jaxtyping import Complex, Float
from msgspec import Meta

from scenes.scene.description import MOST_IN_A_ROW, WIDEST_SPACING, Gateway
from simulate.spectra.angular_grid import direction


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
    >>> y.shape, np.abs(y).round(6).max().item()
    ((16,), 1.0)
    """

    rows: Annotated[int, Meta(ge=1, le=MOST_IN_A_ROW)] = 4
    columns: Annotated[int, Meta(ge=1, le=MOST_IN_A_ROW)] = 4
    spacing: Annotated[float, Meta(gt=0, le=WIDEST_SPACING)] = 0.5

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
