"""Whether the maxima of the spectra point at the transmitters, and whether they would if the azimuths were others.

An array looks the same after some turns and mirrorings: a square one after turns by 90° and mirrored at its axes and
diagonals, a rectangular one after a turn by 180° and mirrored at its axes. Spectra that are turned or mirrored so are
those of the same responses at exchanged elements. So pictures show the azimuth of their first column only up to these.
In line of sight, the positions can show it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, UInt8
from scipy.spatial.transform import Rotation

from simulate.spectra.angular_grid import AngularGrid, direction
from simulate.spectra.array import PlanarArray
from simulate.spectra.spectrum import evenly

EXAMINED = 400
"""Most spectra whose maxima are looked at."""

POINTS = 15.0
"""Degrees. Median angle between maximum and transmitter up to which the maxima point at the transmitters."""

FARTHER = 3.0
"""Other azimuths are believed if the angle as it is is this many times that angle, and above twice ``POINTS``."""


@dataclass(frozen=True)
class Turn:
    """Azimuths that the columns may have instead of the stated ones: ±φ + by.

    Attributes:
        mirrored: whether the azimuths fall from column to column.
        by: azimuth of the first column, degrees.
    """

    mirrored: bool = False
    by: int = 0

    def __str__(self) -> str:
        """The turn in words.

        >>> str(Turn(by=180)), str(Turn(mirrored=True)), str(Turn(True, 90))
        ('turned by 180°', 'mirrored', 'mirrored and turned by 90°')
        """
        words = ["mirrored"] if self.mirrored else []
        return " and ".join([*words, *([f"turned by {self.by}°"] if self.by else [])])

    def option(self, grid: AngularGrid) -> str:
        """The option of ``bisplat convert`` that states these azimuths of pictures on a grid.

        >>> Turn(by=180).option(AngularGrid()), Turn(True, 0).option(AngularGrid())
        ('--azimuths -180 179', '--azimuths 0 -359')
        """
        span = grid.azimuths_deg[-1]
        first = self.by - 360 if self.by and not self.mirrored else self.by
        return f"--azimuths {first:g} {first - span if self.mirrored else first + span:.6g}"


def undecidable(array: PlanarArray) -> list[Turn]:
    """The turns that the pictures of an array cannot show, without the one that changes nothing.

    >>> [str(turn) for turn in undecidable(PlanarArray(2, 3))]
    ['turned by 180°', 'mirrored', 'mirrored and turned by 180°']
    """
    turns = (0, 90, 180, 270) if array.rows == array.columns else (0, 180)
    return [Turn(mirrored, by) for mirrored in (False, True) for by in turns][1:]


def bearing_errors(
    pictures: UInt8[np.ndarray, "K 90 360"],
    grid: AngularGrid,
    towards: Float[np.ndarray, "K 3"],
    turns: list[Turn],
) -> list[float]:
    """Median angle between each spectrum's maximum and the direction of its transmitter, for each turn, degrees.

    Args:
        pictures: the pictures. Those of one grey level are left out.
        grid: their grid.
        towards: vectors from the gateway to the transmitters, gateway frame.
        turns: the azimuths to try.

    Returns:
        The angles; not a number if no picture has a maximum.
    """
    chosen = [index for index in evenly(np.arange(len(pictures)), EXAMINED) if np.ptp(pictures[index])]
    length = np.linalg.norm(towards[chosen], axis=1, keepdims=True)
    units = towards[chosen] / np.where(length > 0, length, 1)
    if not len(units):
        return [np.nan] * len(turns)
    azimuth, elevation = np.moveaxis(np.stack([grid.dominant_angles(pictures[index]) for index in chosen]), -1, 0)
    found = []
    for turn in turns:
        turned = turn.by + (-azimuth if turn.mirrored else azimuth)
        maxima = direction(np.radians(turned), np.radians(elevation))
        cosine = (maxima * units).sum(axis=1).clip(-1, 1)
        found.append(float(np.degrees(np.median(np.arccos(cosine)))))
    return found


def in_gateway_frame(
    positions: Float[np.ndarray, "K 3"], gateway: Float[np.ndarray, 3], orientation: Float[np.ndarray, 4]
) -> Float[np.ndarray, "K 3"]:
    """Vectors from the gateway to positions, in the gateway's frame, metres."""
    return Rotation.from_quat(orientation).apply(positions - gateway, inverse=True)


def likely_turn(
    pictures: UInt8[np.ndarray, "K 90 360"], grid: AngularGrid, array: PlanarArray, towards: Float[np.ndarray, "K 3"]
) -> tuple[float, Turn | None, float]:
    """Whether the maxima point at the transmitters after a turn that the pictures cannot show, and not before.

    Returns:
        Median angle as it is; the turn after which the maxima point at the transmitters, None if there is none or they
        do so already; and the median angle after it.
    """
    turns = [Turn(), *undecidable(array)]
    as_it_is, *others = bearing_errors(pictures, grid, towards, turns)
    best = int(np.argmin(others))
    believed = others[best] < POINTS and as_it_is > max(FARTHER * others[best], 2 * POINTS)
    line = 1 in (array.rows, array.columns)  # whose maxima are the same on both sides of it
    return as_it_is, turns[1 + best] if believed and not line else None, others[best]
