"""How densely known positions lie: their mean spacing in wavelengths, in a volume, in a plane or along a path."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float
from scipy.spatial import ConvexHull

FEWEST = 10
"""From fewer positions no region can be told."""

THICK = 0.5
"""Positions spread along an axis if their extent along it is larger than this, in wavelengths. A field hardly changes
within less."""

PATH = 0.5
"""Positions follow a path if the median step from one to the next is smaller than this share of their mean spacing in
the region. On the shortest walk through positions in a region, the steps are about 0.7 of it; in random order, many
times of it."""

Shape = Literal["volume", "plane", "path"]

POWER: dict[Shape, int] = {"volume": 3, "plane": 2, "path": 1}
"""How many dimensions each shape has."""


@dataclass(frozen=True)
class Spacing:
    """How densely known positions lie.

    Attributes:
        known: number of different known positions.
        shape: what they fill: a volume, a plane (or a layer of less than half a wavelength), or a path.
        size: volume in cubic wavelengths, area in square wavelengths, or length in wavelengths.

    Example:
        >>> Spacing(known=160, shape="volume", size=20.0).sentence()
        'mean spacing 0.5 wavelengths (8 per cubic wavelength)'
    """

    known: int
    shape: Shape
    size: float

    @classmethod
    def between(cls, positions: Float[np.ndarray, "n 3"], wavelength: float) -> Spacing | None:
        """Measure the spacing of known positions.

        The region is not known, so its size is estimated as if the positions were drawn uniformly: their convex hull of
        size H with v corners gives ``H (n + 1) / (n + 1 - v)`` (Efron's identity). It is at most that of the bounding
        box, enlarged by ``(n + 1) / (n - 1)`` along each axis, since positions chosen near the border are nearly all
        corners.

        Positions that were measured several times count once.

        Args:
            positions: known positions in the order of measurement, metres.
            wavelength: metres.

        Returns:
            The spacing. None: there are fewer than ten positions, or all lie within half a wavelength.
        """
        positions = positions[np.sort(np.unique(positions, axis=0, return_index=True)[1])]
        n = len(positions)
        if n < FEWEST:
            return None
        scaled = positions / wavelength
        steps = np.linalg.norm(np.diff(scaled, axis=0), axis=1)
        axes = np.linalg.svd(scaled - scaled.mean(axis=0), full_matrices=False)[2]
        extents = np.ptp(scaled @ axes.T, axis=0)
        wide = extents > THICK
        if not wide.any():
            return None
        if wide.sum() == 1:
            return cls(n, "path", float(extents[wide][0]))
        shape: Shape = "volume" if wide.all() else "plane"
        inside = cls(n, shape, _size(scaled, axes[~wide]))
        if np.median(steps) < PATH * inside.wavelengths:
            return cls(n, "path", float(steps.sum()))
        return inside

    @property
    def density(self) -> float:
        """Known positions per cubic wavelength, square wavelength or wavelength."""
        return self.known / self.size

    @property
    def wavelengths(self) -> float:
        """Mean spacing: the edge of the cube, of the square or of the piece of path that each position has."""
        return float(self.density ** (-1 / POWER[self.shape]))

    def sentence(self) -> str:
        """The spacing in words."""
        if self.shape == "path":
            return f"mean spacing {self.wavelengths:.2g} wavelengths along a path"
        unit = {"volume": "cubic wavelength", "plane": "square wavelength"}[self.shape]
        return f"mean spacing {self.wavelengths:.2g} wavelengths ({self.density:.2g} per {unit})"


def _size(scaled: Float[np.ndarray, "n 3"], normal: Float[np.ndarray, "k 3"]) -> float:
    """Size of the region in which positions were drawn uniformly: a volume, or the area in the plane of a normal."""
    n, flattened, stretch = len(scaled), scaled, 1.0
    if len(normal):  # seen along the world's axis that is nearest to the normal, an area shrinks by the cosine
        along = int(np.abs(normal[0]).argmax())
        flattened, stretch = np.delete(scaled, along, axis=1), 1 / abs(float(normal[0, along]))
    hull = ConvexHull(flattened)
    box = np.prod(np.ptp(flattened, axis=0) * (n + 1) / (n - 1))
    return float(min(hull.volume * (n + 1) / (n + 1 - len(hull.vertices)), box) * stretch)
