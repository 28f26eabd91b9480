"""How to read the pictures of another program's folder: the options of ``bisplat convert``."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Conversion:
    """How to read the pictures of a folder. Most folders need no options, since the pictures show what is needed.

    Attributes:
        flip_elevation: turn the pictures upside down; by default only if an array explains them better that way.
        elevations: elevation of the first and the last row, degrees, for pictures that are not 360 × 90.
        azimuths: azimuth of the first and the last column, degrees, for pictures that are not 360 × 90.
        one_per_position: keep only the picture with this number at each position, counted from 1; by default all.
    """

    flip_elevation: bool | None = None
    elevations: tuple[float, float] | None = None
    azimuths: tuple[float, float] | None = None
    one_per_position: int | None = None
