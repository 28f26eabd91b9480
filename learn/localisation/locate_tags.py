"""Locate tags from their responses along the track of a moving antenna (synthetic aperture)."""

from __future__ import annotations

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import ArrayLike

from learn.localisation.direct_path import DirectPath, Maxima, maximise
from learn.localisation.located_places import LEAST_PROBABILITY, Place
from learn.localisation.refine import MODES, candidate_points, grid_in
from scenes.files.errors import ParameterError, check_array, require_instance
from scenes.scene.description import SPEED_OF_LIGHT
from scenes.scene.frequency import read_frequency
from simulate.exchange.recorded_responses import one_way
from simulate.positions.positions import check_points

LEAST_READS = 4  # Least number of antenna positions at which a tag must be read

MOST_ANTENNAS = 1000  # Largest number of antenna positions; the time grows with its square

SPACING = 1 / 12  # Wavelengths between the grid's points

MOST_POINTS = 40_000  # Largest number of points of the grid; in a larger region they are farther apart

FACTORS = (1e-2, 1e-4)
"""Factors on the variances of ``DirectPath`` that a tag gets if they make its responses more likely."""

PLAIN = 0.1
"""A tag whose magnitudes lie between 1 − PLAIN and 1, on average and at most, has phases alone: means of unit phasors,
as of several reads at a stop, are so long."""

APART = 0.5  # Least distance of two places of a tag, wavelengths

SEPARATE = 3.0  # Least distance of the means of two places, in deviations of their difference

ROUGHLY, CLEAN = 0.05, 1e-3
"""Largest share of the power that the direct path leaves open, at a point of the grid and at a maximum, for which the
variances may be smaller ones. A single reflection that leaves more changes the phases as a wrong place does."""


def locate_tags(
    responses: Complex[ArrayLike, "K N"],
    antennas: Float[ArrayLike, "N 3"],
    frequency: float | str,
    region: Float[ArrayLike, "2 3"],
    *,
    round_trip: bool = False,
    boresight: Float[ArrayLike, " 3"] | None = None,
) -> list[list[Place]]:
    """Locate tags from their responses along the track of a moving antenna (synthetic aperture).

    Nothing else is known: no trained run, no scene, and no other tag. The direct path from a place predicts how phase
    and magnitude change along the track. The likelihood (``DirectPath``) allows for a gain that changes smoothly, for
    multipath and for noise. It is computed over a grid in the region. Where it is broader than the grid's spacing, a
    place is the mean of an area. Elsewhere Newton's steps refine its maxima, and variances that are a hundredth or less
    are tried, since the responses may be clean. Each tag has an unknown phase and magnitude of its own. By reciprocity,
    the tag may be a receiver, too, or the antenna's places those of a transmitter that moves.

    A straight track tells neither on which side of it a tag is, nor how high: ``region`` must leave one side of a
    plane.

    Args:
        responses: complex responses of K tags at N antenna positions, in any unit; NaN where a tag was not read. The
            phase falls with the distance; give the conjugate if a receiver's rises. Magnitudes make places more
            certain; responses of a tag with the magnitude 1, or means of such ones, to 10 %, count as phases alone.
        antennas: positions of the antenna, metres, world frame, in the order in which it passed them.
        frequency: hertz, or a text with a unit such as "915 MHz".
        region: corners (min, max) of the box in which the tags are, metres, world frame. It may be flat.
        boresight: direction in which the antenna looks, world frame, if it has a broad main lobe, as a reader's patch
            has. Its pattern is then taken as the cosine of the angle. None: it looks in all directions alike.
        round_trip: the responses are those of the way to the tag and back by the same antenna, as of an RFID reader.
            Their roots are taken; the phase must change by less than half a turn between two antenna positions.

    Returns:
        The places of each tag, the most probable one first. The misfit is the share of the power that the direct path
        alone does not explain. Along an axis where the region is flat, the covariance is 0. A tag that was read at
        fewer than 4 antenna positions has no place.

    Raises:
        ParameterError: an array has another shape or is not finite, or the region's corners are not (min, max).

    Example:
        >>> track = np.stack([np.linspace(0, 1, 50), np.zeros(50), np.zeros(50)], axis=1)
        >>> distance = np.linalg.norm(track - [0.3, 0.7, 0], axis=1)
        >>> read = np.exp(-4j * np.pi * distance / 0.325) / distance**2  # the way to the tag and back
        >>> box = [[0, 0.2, 0], [1, 1.2, 0]]
        >>> places = locate_tags([read], track, "922.438 MHz", box, round_trip=True)
        >>> places[0][0].position.round(2).tolist()
        [0.3, 0.7, 0.0]
    """
    track = check_points(antennas, "antennas")
    if len(track) > MOST_ANTENNAS:
        raise ParameterError("antennas", f"expected at most {MOST_ANTENNAS} positions, found {len(track)}")
    what = f"responses of tags at {len(track)} antenna positions"
    given = check_array("responses", responses, (None, len(track)), what, "c", finite=False)
    require_instance(bool, round_trip=round_trip)
    box = check_array("region", region, (2, 3), "corners (min, max) of a box")
    if (box[0] > box[1]).any():
        raise ParameterError("region", f"expected corners (min, max), found {box.tolist()}")
    wavelength = SPEED_OF_LIGHT / read_frequency(frequency)
    ahead = None
    if boresight is not None:
        ahead = check_array("boresight", boresight, (3,), "a direction x, y, z")
        if not ahead.any():
            raise ParameterError("boresight", "expected a direction, found a vector of length 0")
        ahead = ahead / np.linalg.norm(ahead)
    read = np.isfinite(given) & (given != 0)
    places: list[list[Place]] = [[] for _ in given]
    patterns, of_tag = np.unique(read, axis=0, return_inverse=True)
    for number, pattern in enumerate(patterns):
        if pattern.sum() < LEAST_READS:
            continue
        tags = np.flatnonzero(of_tag.ravel() == number)
        seen = given[np.ix_(tags, pattern)]
        seen = one_way(seen, []) if round_trip else seen
        magnitudes = np.abs(seen)
        plain = (magnitudes.mean(axis=1) > 1 - PLAIN) & (magnitudes.max(axis=1) < 1 + 1e-6)
        for phases_only in np.unique(plain):
            some = plain == phases_only
            model = DirectPath(track[pattern], wavelength, ahead, bool(phases_only))
            for tag, found in zip(tags[some], _located(model, seen[some], box), strict=True):
                places[tag] = found
    return places


def _located(model: DirectPath, seen: Complex[np.ndarray, "K N"], box: Float[np.ndarray, "2 3"]) -> list[list[Place]]:
    """The places of tags that were all read at all antenna positions."""
    points = np.unique(grid_in(box, SPACING * model.wavelength, MOST_POINTS), axis=0)
    likely = model.log_likelihood(points, seen)
    starts = np.stack([candidate_points(points, of_tag, APART * model.wavelength) for of_tag in likely])
    areas = [_areas(some, points, of_tag) for some, of_tag in zip(starts, likely, strict=True)]
    largest = [int(each.evidence.argmax()) for each in areas]
    misfit = [model.unexplained(each.positions, one) for each, one in zip(areas, seen, strict=True)]
    broad = [
        np.trace(each.covariances[which]) > (SPACING * model.wavelength) ** 2
        for each, which in zip(areas, largest, strict=True)
    ]
    places = [_places(*each) for each in zip(areas, misfit, strict=True)]
    for tag in np.flatnonzero(
        [off[which] < ROUGHLY for off, which in zip(misfit, largest, strict=True)] + ~np.array(broad)
    ):
        rows = np.tile(seen[tag], (MODES, 1))
        maxima = maximise(model, rows, starts[tag], box)
        clean = model.unexplained(maxima.positions, seen[tag]).min() < CLEAN
        if clean:
            others = [maximise(model.quieter(factor), rows, maxima.positions, box) for factor in FACTORS]
            maxima = max([maxima, *others], key=lambda each: each.evidence.max())
        if clean or not broad[tag]:
            maxima = maxima.apart(APART * model.wavelength / 2)
            places[tag] = _places(maxima, model.unexplained(maxima.positions, seen[tag]))
    return places


def _areas(
    starts: Float[np.ndarray, "MODES 3"], points: Float[np.ndarray, "G 3"], likely: Float[np.ndarray, " G"]
) -> Maxima:
    """Mean, covariance and probability of the area around each start, that is, of the points nearest to it.

    Where the likelihood is broad it has ripples, and the curvature at one of these does not tell how broad it is. Areas
    that a normal distribution would not keep apart become one.
    """
    owner = np.linalg.norm(points[:, None] - starts, axis=-1).argmin(axis=1)
    weight = np.exp(likely - likely.max())
    masses = np.bincount(owner, weight, len(starts))
    areas = [owner == each for each in np.flatnonzero(masses > LEAST_PROBABILITY * masses.sum())]
    moments = [_moments(points, weight * area) for area in areas]
    while len(areas) > 1:
        pairs = [(i, j) for i in range(len(areas)) for j in range(i)]
        nearest = min(pairs, key=lambda pair: _separation(moments[pair[0]], moments[pair[1]]))
        if _separation(moments[nearest[0]], moments[nearest[1]]) > SEPARATE:
            break
        merged = areas.pop(nearest[0]) | areas[nearest[1]]
        del moments[nearest[0]]
        areas[nearest[1]], moments[nearest[1]] = merged, _moments(points, weight * merged)
    means, covariances, masses = (np.stack(each) for each in zip(*moments, strict=True))
    return Maxima(means, covariances, np.log(masses))


def _moments(
    points: Float[np.ndarray, "G 3"], weight: Float[np.ndarray, " G"]
) -> tuple[Float[np.ndarray, " 3"], Float[np.ndarray, "3 3"], float]:
    """Mean and covariance of weighted points, and the sum of the weights."""
    mean = weight @ points / weight.sum()
    return mean, (weight[:, None] * (points - mean)).T @ (points - mean) / weight.sum(), weight.sum()


def _separation(one: tuple, other: tuple) -> float:
    """Distance of two means in deviations of their difference."""
    apart = one[0] - other[0]
    return float(np.sqrt(apart @ np.linalg.pinv(one[1] + other[1]) @ apart))


def _places(maxima: Maxima, misfit: Float[np.ndarray, " m"]) -> list[Place]:
    """The places of a tag, the most probable one first."""
    probability = np.exp(maxima.evidence - maxima.evidence.max())
    probability /= probability.sum()
    rows = zip(maxima.positions, maxima.covariances, probability.tolist(), misfit.tolist(), strict=True)
    found = [Place(*each) for each in rows]
    return sorted((each for each in found if each.probability >= LEAST_PROBABILITY), key=lambda each: -each.probability)
