"""Whether the maxima of the spectra point at the transmitters, and whether they would if the azimuths were others.

An array looks the same after some turns and mirrorings: a square one after turns by 90° and mirrored at its axes and
diagonals, a rectangular one after a turn by 180° and mirrored at its axes, a circle of n elements after n turns and
mirrored at n axes. Spectra that are turned or mirrored so are those of the same responses at exchanged elements. So
pictures show the azimuth of their first column only up to these. In line of sight, the positions can show it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from simulate.dataset.dataset import Dataset
from simulate.spectra.angular_grid import AngularGrid, direction
from simulate.spectra.array import Array, PlanarArray
from simulate.spectra.element_array import uniform
from simulate.spectra.spectrum import evenly

EXAMINED = 400  # Most spectra whose maxima are looked at

POINTS = 15.0
"""Degrees. Median angle between maximum and transmitter up to which the maxima point at the transmitters."""

ALIKE = 1e-3
"""An array looks the same if each element is this near to the place of another, relative to the array's size."""

FARTHER = 3.0
"""Another reading is believed if the angle as it is is this many times that angle, and above twice ``POINTS``."""

GRATING = 0.75
"""Wavelengths between neighbouring elements from which most directions have a grating lobe: a copy is in view beyond a
sine of 1 / spacing − 1 from the boresight, which is a third. The strongest of the copies is then chance."""


@dataclass(frozen=True)
class Turn:
    """Azimuths that the columns may have instead of the stated ones: ±φ + by."""

    mirrored: bool = False  # whether the azimuths fall from column to column
    by: float = 0  # azimuth of the first column, degrees

    def __str__(self) -> str:
        """The turn in words."""
        words = ["mirrored"] if self.mirrored else []
        return " and ".join([*words, *([f"turned by {self.by:.6g}°"] if self.by else [])])

    def option(self, grid: AngularGrid) -> str:
        """The option of ``bisplat dataset`` that states these azimuths of pictures on a grid."""
        span = grid.azimuths_deg[-1]
        first = self.by - 360 if self.by and not self.mirrored else self.by
        return f"--azimuths {first:.6g} {first - span if self.mirrored else first + span:.6g}"


def turns_of(array: Array) -> list[Turn]:
    """The turns and mirrorings that leave an array the same; first the one that changes nothing."""
    if not isinstance(array, PlanarArray):
        return _turns_of_places(array.positions - array.positions.mean(axis=0))
    turns = (0, 90, 180, 270) if array.rows == array.columns else (0, 180)
    return [Turn(mirrored, by) for mirrored in (False, True) for by in turns]


def _turns_of_places(places: Float[np.ndarray, "elements 3"]) -> list[Turn]:
    """The turns about z and mirrorings that map places (relative to their mean) onto themselves."""
    radius, azimuth = np.hypot(places[:, 0], places[:, 1]), np.degrees(np.arctan2(places[:, 1], places[:, 0]))
    size = max(float(np.linalg.norm(places, axis=1).max()), 1e-12)
    first, tree = int(radius.argmax()), cKDTree(places)
    if radius[first] < ALIKE * size:  # a line along the boresight looks the same after every turn
        return [Turn(mirrored, by) for mirrored in (False, True) for by in (0, 180)]
    alike = (np.abs(radius - radius[first]) < ALIKE * size) & (np.abs(places[:, 2] - places[first, 2]) < ALIKE * size)
    found = []
    for mirrored, sign in ((False, 1), (True, -1)):
        angles = (azimuth[alike] - sign * azimuth[first]) % 360
        for by in np.unique(np.round(angles, 6) % 360):
            turned = Rotation.from_euler("z", by, degrees=True).apply(places * [1, sign, 1])
            if tree.query(turned)[0].max() < ALIKE * size:
                found.append(Turn(mirrored, int(by) if by == int(by) else float(by)))
    return found


@dataclass(frozen=True)
class Bearing:
    """How far the maxima of a dataset's spectra are from the directions of the transmitters."""

    error: float  # median angle between them, degrees; not a number if no picture has a maximum
    # the turn after which the maxima point at the transmitters; None if there is none or they do so already
    turn: Turn | None
    error_after: float  # median angle after the best turn, degrees
    # median angle if the array is at the positions and the transmitter at the gateway's, degrees; None if that is not
    # believed, or if the folder states what moves
    error_if_moved: float | None = None
    # distance between neighbouring elements, wavelengths, if they are so far apart that grating lobes tell nothing of
    # turns and moves; otherwise None
    grating: float | None = None

    def doubt(self, grid: AngularGrid) -> str | None:
        """A sentence if the azimuths of pictures on a grid seem to be others, or if the array seems to have moved."""
        if self.grating is not None:
            if not self.error > 2 * POINTS:
                return None
            return (
                f"the strongest directions are {self.error:.0f}° from those of the transmitters (median): elements "
                f"{self.grating:.3g} wavelengths apart have grating lobes, copies of a direction that are as bright"
            )
        found = []
        if self.turn is not None:
            found.append(
                f"the strongest directions point at the transmitters ({self.error_after:.0f}° off, median) if the "
                f"pictures are {self.turn}, and not as they are ({self.error:.0f}° off): bisplat dataset "
                f"{self.turn.option(grid)} reads them so"
            )
        if self.error_if_moved is not None:
            found.append(
                f"the strongest directions point at one transmitter ({self.error_if_moved:.0f}° off, median) if "
                f"tx_pos.csv holds the places of an array that moved, and not if it holds those of transmitters "
                f"({self.error:.0f}° off): bisplat dataset --moving receiver states it"
            )
        return "; or ".join(found) or None


def bearing_of(dataset: Dataset) -> Bearing:
    """Compare the maxima of a dataset's spectra with the directions of its transmitters."""
    to_gateway_frame = Rotation.from_quat(dataset.gateway_orientation).inv()
    towards = to_gateway_frame.apply(dataset.transmitters - dataset.receivers)
    distance = np.linalg.norm(towards, axis=1)
    chosen = [
        index
        for index in evenly(np.arange(len(towards)), EXAMINED)
        if distance[index] > 0 and np.ptp(dataset.pictures[index])
    ]
    if not chosen:
        return Bearing(np.nan, None, np.nan)
    units = towards[chosen] / distance[chosen, None]
    angles = np.stack([dataset.grid.dominant_angles(dataset.pictures[index]) for index in chosen])
    azimuth, elevation = np.radians(angles).T
    grating = _grating_spacing(dataset.array)
    turns = turns_of(dataset.array) if grating is None else [Turn()]
    errors = []
    for turn in turns:
        maxima = direction(np.radians(turn.by) + (-azimuth if turn.mirrored else azimuth), elevation)
        errors.append(float(np.median(dataset.array.angle_between(maxima, units))))
    moved = None
    if "moving" not in dataset.metadata and grating is None:
        moved = float(np.median(dataset.array.angle_between(direction(azimuth, elevation), -units)))
        moved = moved if _believed(moved, errors[0]) else None
    if len(turns) == 1:
        return Bearing(errors[0], None, errors[0], moved, grating)
    best = 1 + int(np.argmin(errors[1:]))
    line = dataset.array.is_line  # whose maxima are the same on both sides of it
    believed = _believed(errors[best], errors[0]) and not line
    return Bearing(errors[0], turns[best] if believed else None, errors[best], moved)


def _grating_spacing(array: Array) -> float | None:
    planar = uniform(array)
    return planar.spacing if planar is not None and planar.elements > 1 and planar.spacing >= GRATING else None


def _believed(error: float, as_it_is: float) -> bool:
    """Whether another reading is believed that leaves some error, degrees, where the folder as it is leaves another."""
    return error < POINTS and as_it_is > max(FARTHER * error, 2 * POINTS)
