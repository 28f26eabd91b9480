"""How to read the pictures of another program's folder: the options of ``bisplat convert``."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Conversion:
    """How to read the pictures. Most folders need none of these options.

    Attributes:
        flip_elevation: turn the pictures upside down. None: only if an array then explains them better.
        elevations: elevations of the first and last row, degrees, for pictures that are not 360 × 90.
        azimuths: azimuths of the first and last column, degrees, for pictures that are not 360 × 90.
        one_per_position: number of the picture to keep at each position, from 1. None: keep all.
    """

    flip_elevation: bool | None = None
    elevations: tuple[float, float] | None = None
    azimuths: tuple[float, float] | None = None
    one_per_position: int | None = None
