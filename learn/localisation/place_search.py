"""The search for places of transmitters: a grid, the likelihood's areas on it, and its maxima between the points."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Shaped

from learn.localisation.evidence import Evidence
from learn.localisation.located_places import LEAST_PROBABILITY, Located, Place, copied_positions
from learn.models.base import Report
from learn.planning.candidates import extended_axes
from simulate.spectra.spectrum import evenly

SPACING = 1 / 8
"""Wavelengths between the grid's points. What is heard changes completely within a quarter of a wavelength."""

MODES = 4  # Largest number of places of a transmitter

APART = 0.5
"""Least distance of two starting points of a transmitter, wavelengths. Maxima closer than half of it count as one."""

SPACINGS_APART = 4  # The same on a coarse grid, in spacings of its points

MISSED = 1.0
"""Logarithm of the factor by which a maximum has more mass than the grid tells of the largest area, if it is narrower
than the cells. By fewer, ripples of broad likelihoods would count."""

NARROW = 2.0  # Variance of an area, in squares of the spacing, below which its maxima are searched

SEPARATE = 3.5
"""Least distance of the means of two areas, in deviations of their difference. It is 1.9 for the halves of a normal
density, 2.4 for those of a uniform one. From 2.8 on, ripples of fading would count as places of their own."""


class Found(NamedTuple):
    """Places that may be a transmitter's: positions, covariances, and the logarithm of the probability of each."""

    positions: Float[np.ndarray, "m 3"]
    covariances: Float[np.ndarray, "m 3 3"]
    mass: Float[np.ndarray, " m"]

    def apart(self, least: float) -> Found:
        """Those at least so far apart, in metres, the most probable one first."""
        kept: list[int] = []
        for each in np.argsort(-self.mass):
            if all(np.linalg.norm(self.positions[each] - self.positions[other]) > least for other in kept):
                kept.append(int(each))
        return Found(*(each[kept] for each in self))


class Grid:
    """Points in a region, in the plane or on the line of known positions if these extend no further."""

    def __init__(self, evidence: Evidence):
        self.region, self.wavelength = evidence.region, evidence.wavelength
        points = grid_in(evidence.region, SPACING * evidence.wavelength, evidence.most)
        self.axes = np.eye(3)[evidence.region[1] > evidence.region[0]]
        """[d, 3] unit vectors along which the region extends."""
        if evidence.known is not None:
            centre, along = extended_axes(evidence.known)
            if len(along) < len(self.axes):
                self.axes, points = along, centre + (points - centre) @ along.T @ along
        extent = np.ptp(points @ self.axes.T, axis=0)
        self.cell = float(np.prod(extent)) / len(points)
        """Length, area or volume of a point's cell."""
        self.spacing = self.cell ** (1 / max(1, len(self.axes))) if len(self.axes) else 0.0
        if evidence.prior is not None and evidence.known is not None:
            inside = ((evidence.known >= evidence.region[0]) & (evidence.known <= evidence.region[1])).all(axis=1)
            points = np.concatenate([points, evenly(evidence.known[inside], evidence.most)])
        self.points = points


def grid_in(region: Float[np.ndarray, "2 3"], spacing: float, most: int) -> Float[np.ndarray, "n 3"]:
    """Points of a grid that includes the corners of a box, wider than ``spacing`` apart if they were too many."""
    free = region[1] > region[0]
    counts = np.full(3, np.inf)
    while counts.prod() > 1.5 * most:
        counts = np.where(free, np.maximum(2, np.ceil((region[1] - region[0]) / spacing - 1e-9) + 1), 1)
        spacing *= 1.05
    axes = [np.linspace(low, high, int(count)) for low, high, count in zip(*region, counts, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def search(evidence: Evidence, report: Report = lambda phase, done, total: None) -> list[list[Place]]:
    """The places of each transmitter, the most probable one first; none if nothing was heard of it."""
    found: list[list[Place]] = [[] for _ in evidence.told]
    told = np.flatnonzero(evidence.told)
    if not len(told):
        return found
    grid = Grid(evidence)
    density = np.zeros(len(grid.points)) if evidence.prior is None else evidence.prior(grid.points)
    evidence.report = report
    likelihoods = evidence.log_likelihood(grid.points, evidence.heard[told])
    for done, (number, likely) in enumerate(zip(told, likelihoods, strict=True)):
        report("positions", done, len(told))
        found[number] = _places(evidence, grid, evidence.heard[number], density + likely)
    return found


def _places(
    evidence: Evidence, grid: Grid, row: Shaped[np.ndarray, " *each"], likely: Float[np.ndarray, " n"]
) -> list[Place]:
    """The places of one transmitter, by its likelihood on the grid."""
    apart = max(APART * grid.wavelength, SPACINGS_APART * grid.spacing)
    starts = candidate_points(grid.points, likely, apart)
    found = None if evidence.numbers else areas(grid, starts, likely)
    if found is None or _may_hide_more(found, evidence, grid, row):
        maxima = _weighed(maximise(evidence, row, grid, starts), evidence, grid)
        if found is None or maxima.mass.max() > found.mass.max() + MISSED:
            found = maxima.apart(APART * grid.wavelength / 2)
    probability = np.exp(found.mass - found.mass.max())
    probability /= probability.sum()
    rows = zip(*found[:2], probability.tolist(), evidence.misfit(found.positions, row).tolist(), strict=True)
    places = (Place(*each) for each in rows if each[2] >= LEAST_PROBABILITY)
    return sorted(places, key=lambda place: -place.probability)


def _may_hide_more(found: Found, evidence: Evidence, grid: Grid, row: Shaped[np.ndarray, " *each"]) -> bool:
    """Whether the largest area is about as narrow as a cell, or explains nearly all."""
    largest = int(found.mass.argmax())
    narrow = np.trace(found.covariances[largest]) < NARROW * grid.spacing**2
    return bool(narrow or evidence.misfit(found.positions[[largest]], row)[0] < evidence.clean)


def _weighed(maxima: Found, evidence: Evidence, grid: Grid) -> Found:
    """Maxima with their probabilities, by the prior and, if their tails are not heavy, the volume that they span.

    With heavy tails the covariance is that of Student's t distribution. Measured data are located worse with the volume
    as a further factor, since a field is flat where it is wrong.
    """
    positions, covariances, mass = maxima
    if evidence.prior is not None:
        mass = mass + evidence.prior(positions)
    if evidence.numbers is not None:
        return Found(positions, covariances * evidence.numbers / max(evidence.numbers - 3, 1), mass)
    volume = np.linalg.slogdet(2 * np.pi * grid.axes @ covariances @ grid.axes.T)[1]
    return Found(positions, covariances, mass + volume / 2)


def candidate_points(
    points: Float[np.ndarray, "n 3"], likely: Float[np.ndarray, " n"], apart: float
) -> Float[np.ndarray, "MODES 3"]:
    """The most likely point, then the next ones that are far enough from all before. The last one may repeat."""
    left, starts = likely.copy(), list[np.ndarray]()
    for _ in range(MODES):
        best = int(left.argmax())
        starts.append(points[best] if left[best] > -np.inf else starts[-1])
        left[np.linalg.norm(points - points[best], axis=1) < apart] = -np.inf
    return np.stack(starts)


def areas(grid: Grid, starts: Float[np.ndarray, "MODES 3"], likely: Float[np.ndarray, " n"]) -> Found:
    """Mean, covariance and mass of the area around each start, that is, of the points nearest to it.

    Where the likelihood is broad it has ripples, and the curvature at one of these does not tell how broad it is. Areas
    that a normal distribution would not keep apart become one. The mean has the least mean square error.
    """
    owner = np.linalg.norm(grid.points[:, None] - starts, axis=-1).argmin(axis=1)
    weight = np.exp(likely - likely.max())
    masses = np.bincount(owner, weight, len(starts))
    parts = [owner == each for each in np.flatnonzero(masses > LEAST_PROBABILITY * masses.sum())]
    moments = [_moments(grid, weight * part) for part in parts]
    while len(parts) > 1:
        pairs = [(i, j) for i in range(len(parts)) for j in range(i)]
        nearest = min(pairs, key=lambda pair: _separation(moments[pair[0]], moments[pair[1]]))
        if _separation(moments[nearest[0]], moments[nearest[1]]) > SEPARATE:
            break
        merged = parts.pop(nearest[0]) | parts[nearest[1]]
        del moments[nearest[0]]
        parts[nearest[1]], moments[nearest[1]] = merged, _moments(grid, weight * merged)
    means, covariances, sums = (np.stack(each) for each in zip(*moments, strict=True))
    return Found(means, covariances, np.log(sums * grid.cell) + likely.max())


def _moments(
    grid: Grid, weight: Float[np.ndarray, " n"]
) -> tuple[Float[np.ndarray, " 3"], Float[np.ndarray, "3 3"], float]:
    """Mean and covariance of weighted points and the cells around them, and the sum of the weights."""
    whole = weight.sum()
    mean = weight @ grid.points / whole
    away = grid.points - mean
    return mean, (weight * away.T) @ away / whole + grid.spacing**2 / 12 * grid.axes.T @ grid.axes, whole


def _separation(one: tuple, other: tuple) -> float:
    """Distance of two means in deviations along the line between them: Ashman's D / √2 [ashman1994]."""
    apart = one[0] - other[0]
    return float(apart @ apart / np.sqrt(apart @ (one[1] + other[1]) @ apart))


STEPS, STEP = 24, 0.01
"""Most of Newton's steps, and the first distance of the points that show the derivatives, wavelengths."""

LONGEST, FARTHEST = 1 / 8, 1 / 4
"""Largest distance that a position moves in one step, and in all, wavelengths."""

LEAST_GAIN = 1e-3  # The steps end when none promises or makes a larger gain of the log-likelihood


def maximise(
    evidence: Evidence, row: Shaped[np.ndarray, " *each"], grid: Grid, starts: Float[np.ndarray, "M 3"]
) -> Found:
    """Newton's steps from the starts to maxima nearby, the covariances from the curvature there, and the heights."""
    unit, farthest = grid.wavelength, max(FARTHEST * grid.wavelength, grid.spacing)
    positions, value = starts.copy(), next(evidence.log_likelihood(starts, row[None]))
    step = np.full((len(starts), len(grid.axes)), STEP * unit)
    damping = np.ones(len(starts))
    for _ in range(STEPS):
        slope, curvature = evidence.derivatives(positions, row, grid.axes, step)
        shares, turn = _eigen(curvature, unit)
        along = np.einsum("mij,mi->mj", turn, slope)
        if (np.square(along) / shares).sum(axis=1).max() < LEAST_GAIN:
            break
        ahead = np.einsum("mij,mj->mi", turn, along / (shares * damping[:, None])) @ grid.axes
        away = positions + _at_most(ahead, LONGEST * unit) - starts
        moved = np.clip(starts + _at_most(away, farthest), *grid.region)
        after = next(evidence.log_likelihood(moved, row[None]))
        if np.abs(after - value).max() < LEAST_GAIN:
            break
        better = after > value
        positions[better], value[better] = moved[better], after[better]
        damping = np.where(better, np.maximum(damping / 4, 1), damping * 4)
        deviation = 1 / np.sqrt(np.maximum(np.abs(np.einsum("mii->mi", curvature)), 1e-12))
        step = np.clip(deviation / 4, 1e-5 * unit, STEP * unit)
    # A field that interpolates is flat at a known position and steep around it, as only a long step shows.
    wide = np.full_like(step, LONGEST * unit)
    both = [evidence.derivatives(positions, row, grid.axes, each)[1] for each in (step, wide)]
    (short, turn), (long, turned) = (_eigen(each, unit) for each in both)
    steeper = short.sum(axis=1) >= long.sum(axis=1)
    shares = np.where(steeper[:, None], short, long)
    across = np.where(steeper[:, None, None], turn, turned).transpose(0, 2, 1) @ grid.axes
    covariances = across.transpose(0, 2, 1) @ (across / shares[:, :, None])
    return Found(positions, covariances, value)


def _at_most(step: Float[np.ndarray, "M 3"], longest: float) -> Float[np.ndarray, "M 3"]:
    length = np.linalg.norm(step, axis=1, keepdims=True)
    return step * np.minimum(1, longest / np.maximum(length, 1e-12))


def _eigen(
    curvature: Float[np.ndarray, "M d d"], wavelength: float
) -> tuple[Float[np.ndarray, "M d"], Float[np.ndarray, "M d d"]]:
    """Eigenvalues of the curvature, and its axes. No deviation is larger than a wavelength, as derivatives say nothing
    about places farther away."""
    shares, axes = np.linalg.eigh(curvature)
    return np.maximum(np.abs(shares), 1 / wavelength**2), axes


def grid_warning(evidence: Evidence) -> str | None:
    """A warning about a region so large that the grid may miss a transmitter. None: there is no such risk."""
    points = grid_in(evidence.region, SPACING * evidence.wavelength, evidence.most)
    widest = max(float(np.diff(np.unique(axis)).max(initial=0)) for axis in points.T) / evidence.wavelength
    if widest <= FARTHEST:
        return None
    return (
        f"the {len(points)} grid points in this large region are {widest:.2g} wavelengths apart; beyond {FARTHEST:g}, "
        "transmitters between them may be missed unless they are near training positions"
    )


class Question(NamedTuple):
    """K transmitters to be located."""

    evidence: Evidence
    names: Sequence[str]
    parts: Sequence[str]
    truth: Float[np.ndarray, "K 3"] | None = None

    def answered(self, report: Report = lambda phase, done, total: None) -> Located:
        """Where the transmitters may be, beside copied positions where the true ones are known."""
        evidence, copied = self.evidence, None
        places = search(evidence, report)
        if self.truth is not None and evidence.known is not None and (unlike := evidence.unlike()) is not None:
            copied = copied_positions(unlike, evidence.known)
        return Located(places, self.names, self.parts, self.truth, copied)
