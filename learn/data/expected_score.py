"""How densely known positions lie, and what score to expect from that: a curve of several rooms, expected_score.json.

``benchmarks/data/spacing.py`` measures the scores and writes the file.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.spatial import ConvexHull

from scenes.files.plain_text import say
from simulate.spectra.array import Array
from simulate.spectra.element_array import uniform

FEWEST = 10  # From fewer positions no region can be told

THICK = 0.5
"""Positions spread along an axis if their extent along it is larger than this, in wavelengths. A field hardly changes
within less."""

PATH = 0.5
"""Positions follow a path if the median step from one to the next is smaller than this share of their mean spacing in
the region. On the shortest walk through positions in a region, the steps are about 0.7 of it; in random order, many
times of it."""

Shape = Literal["volume", "plane", "path"]

POWER: dict[Shape, int] = {"volume": 3, "plane": 2, "path": 1}  # How many dimensions each shape has


@dataclass(frozen=True)
class Spacing:
    """How densely known positions lie."""

    known: int  # number of different known positions
    shape: Shape  # what they fill: a volume, a plane (or a layer of less than half a wavelength), or a path
    size: float  # volume in cubic wavelengths, area in square wavelengths, or length in wavelengths

    @classmethod
    def between(cls, positions: Float[np.ndarray, "n 3"], wavelength: float) -> Spacing | None:
        """Measure the spacing of known positions.

        The region is not known, so its size is estimated as if the positions were drawn uniformly: their convex hull of
        size H with v corners gives ``H (n + 1) / (n + 1 - v)`` (Efron's identity). It is at most that of the bounding
        box, enlarged by ``(n + 1) / (n - 1)`` along each axis, since positions chosen near the border are nearly all
        corners.

        Positions that were measured several times count once.
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


FILE = Path(__file__).with_suffix(".json")

ELEMENTS = (4, 4)
"""Rows and columns of the arrays with which the scores were measured. A finer beam scores less at the same spacing."""

SPACINGS = 0.4, 0.6
"""Wavelengths between neighbouring elements for which the scores stand. They were measured with 0.5. Within a fifth of
it, as NeRF²'s 0.491 is, the beam is about as wide. Far above it there are grating lobes and finer beams, and the score
is much lower: 0.16 at 2.7. Far below it, the beam is wider."""


class Expected(NamedTuple):
    """Median SSIM to expect: the lowest of the rooms, their median, and the highest."""

    low: float
    middle: float
    high: float


@dataclass(frozen=True)
class ScoreCurve:
    """The score over the density of the known positions. Each of its three lines rises, or is level."""

    density: Float[np.ndarray, " k"]  # [k] rising; known positions per cubic or square wavelength
    low: Float[np.ndarray, " k"]  # [k] median SSIM of the room with the lowest
    middle: Float[np.ndarray, " k"]  # [k] the median over the rooms
    high: Float[np.ndarray, " k"]  # [k] that of the room with the highest

    @classmethod
    def over(cls, rooms: Mapping[str, Mapping[float, float]]) -> ScoreCurve:
        """The curve over several rooms, at densities that all of them have; level where a score falls, by chance."""
        common = sorted(set.intersection(*(set(room) for room in rooms.values())))
        scores = np.array([[room[density] for density in common] for room in rooms.values()])
        return cls(
            density=np.array(common, float),
            low=np.minimum.accumulate(scores.min(axis=0)[::-1])[::-1],
            middle=np.maximum.accumulate(np.median(scores, axis=0)),
            high=np.maximum.accumulate(scores.max(axis=0)),
        )

    def at(self, density: float) -> Expected:
        """The score to expect, between the curve's densities by their logarithms, beyond them that of the end."""
        where = np.log(density), np.log(self.density)
        return Expected(*(float(np.interp(*where, line)) for line in (self.low, self.middle, self.high)))

    def density_for(self, score: float) -> float:
        """The least density at which the middle line reaches a score between its ends."""
        reached, first = np.unique(self.middle, return_index=True)
        return float(np.exp(np.interp(score, reached, np.log(self.density[first]))))


def scores_in(file: Path, shape: Shape) -> dict[str, dict[float, float]]:
    """The measured scores of a file: by the room's name, density -> median SSIM."""
    rooms = json.loads(file.read_text())["rooms"]
    return {room: {float(density): score for density, score in scores[shape].items()} for room, scores in rooms.items()}


@cache
def score_curve(shape: Shape) -> ScoreCurve:
    """The curve of known positions in a "volume" or in a "plane"."""
    return ScoreCurve.over(scores_in(FILE, shape))


def is_measured(array: Array) -> bool:
    """Whether the curves were measured with uniform planar arrays like this one."""
    planar = uniform(array)
    return (
        planar is not None
        and (planar.rows, planar.columns) == ELEMENTS
        and SPACINGS[0] <= planar.spacing <= SPACINGS[1]
    )


def expectation(spacing: Spacing, array: Array, responses: bool) -> str:
    """One sentence: the mean spacing of known positions, and the score to expect from it."""
    if spacing.shape == "path":
        return f"{spacing.sentence()}: what score to expect is known of positions in a region alone"
    if not is_measured(array):
        return f"{spacing.sentence()}: what score to expect is known of 4 × 4 elements half a wavelength apart alone"
    if not responses:
        return f"{spacing.sentence()}: what score to expect is known of datasets with responses alone"
    curve = score_curve(spacing.shape)
    low, middle, high = curve.at(spacing.density)
    bound = "at most " if spacing.density < curve.density[0] else ""
    if spacing.density > curve.density[-1]:
        bound = "at least "
    return (
        f"{spacing.sentence()}: expect a median SSIM of {bound}about {middle:.2f} ({low:.2f} to {high:.2f}) from "
        "helmholtz between the known positions"
    )


def facts(spacing: Spacing, array: Array, responses: bool) -> dict[str, Any]:
    """The spacing and the score to expect as numbers, for JSON."""
    expected = None
    if spacing.shape != "path" and is_measured(array) and responses:
        expected = [round(each, 3) for each in score_curve(spacing.shape).at(spacing.density)]
    spaced = round(spacing.wavelengths, 3)
    return {"known_positions_fill": spacing.shape, "mean_spacing_wavelengths": spaced, "expected_ssim": expected}


def say_expectation(known: Float[np.ndarray, "n 3"], wavelength: float, array: Array, responses: bool) -> None:
    """Say how densely known positions lie and what score to expect; nothing if their spacing cannot be told."""
    spacing = Spacing.between(known, wavelength)
    if spacing is not None:
        say(expectation(spacing, array, responses))
