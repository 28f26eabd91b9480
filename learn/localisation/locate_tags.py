"""Locate tags from their responses along the track of a moving antenna (synthetic aperture)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Complex, Float
from numpy.typing import ArrayLike

from learn.localisation.direct_path import DirectPath
from learn.localisation.locate import LEAST_PROBABILITY, Place
from learn.models.geometry import grid_in
from scenes.files.array_argument import check_array
from scenes.files.errors import ParameterError, require_instance
from scenes.scene.description import SPEED_OF_LIGHT
from scenes.scene.frequency import read_frequency
from simulate.exchange.recorded_rows import one_way
from simulate.positions.given_positions import check_points

LEAST_READS = 4
"""Least number of antenna positions at which a tag must be read."""

SPACING = 1 / 12
"""Wavelengths between the grid's points."""

MOST_POINTS = 40_000
"""Largest number of points of the grid; in a larger region they are farther apart."""

FACTORS = (1e-2, 1e-4)
"""Factors on the variances of ``DirectPath`` that a tag gets if they make its responses more likely."""

MODES, APART = 4, 0.5
"""Largest number of places of a tag, and their least distance in wavelengths."""

SEPARATE = 3.0
"""Least distance of the means of two places, in deviations of their difference."""

STEPS, STEP = 12, 0.01
"""Newton's steps, and the first distance of the points that show the derivatives, wavelengths."""


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
    and magnitude change along the track; the likelihood (``DirectPath``) allows for a gain that changes smoothly, for
    multipath and for noise. It is computed over a grid in the region; Newton's steps refine its maxima. Each tag has an
    unknown phase and magnitude of its own. By reciprocity, the tag may be a receiver, too, or the antenna's places those
    of a transmitter that moves.

    A straight track does not tell on which side of it a tag is, nor how high: ``region`` must leave one side of a plane.

    Args:
        responses: complex responses of K tags at N antenna positions, in any unit; NaN where a tag was not read. The
            phase falls with the distance; give the conjugate if a receiver's rises.
        antennas: positions of the antenna, metres, world frame, in the order in which it passed them.
        frequency: hertz, or a text with a unit such as "915 MHz".
        region: corners (min, max) of the box in which the tags are, metres, world frame. It may be flat.
        boresight: direction in which the antenna looks, world frame, if it has a broad main lobe, as a reader's patch
            has. Its pattern is then taken as the cosine of the angle. None: it looks in all directions alike.
        round_trip: the responses are those of the way to the tag and back by the same antenna, as of an RFID reader.
            Their roots are taken; the phase must change by less than half a turn between two antenna positions.

    Returns:
        The places of each tag, the most probable one first. The misfit is the share of the power that the direct path
        alone does not explain. Along an axis where the region is flat, the covariance is 0. A tag that was read at fewer
        than 4 antenna positions has no place.

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
        model = DirectPath(track[pattern], wavelength, ahead)
        for tag, found in zip(tags, _located(model, seen, box), strict=True):
            places[tag] = found
    return places


def _located(
    model: DirectPath, seen: Complex[np.ndarray, "K N"], box: Float[np.ndarray, "2 3"]
) -> list[list[Place]]:
    """The places of tags that were all read at all antenna positions."""
    points = np.unique(grid_in(box, SPACING * model.wavelength, MOST_POINTS), axis=0)
    likely = model.log_likelihood(points, seen)
    starts = np.concatenate([_starts(points, each, APART * model.wavelength) for each in likely])
    rows = np.repeat(seen, MODES, axis=0)
    best = _maximise(model, rows, starts, box)
    as_given = np.ones(len(seen), bool)
    for factor in FACTORS:
        found = _maximise(model.quieter(factor), rows, best.positions, box)
        better = found.evidence.reshape(-1, MODES).max(axis=1) > best.evidence.reshape(-1, MODES).max(axis=1)
        best, as_given = best.replaced(np.repeat(better, MODES), found), as_given & ~better
    places = []
    for tag in range(len(seen)):
        some = slice(tag * MODES, (tag + 1) * MODES)
        maxima = _Maxima(*(each[some] for each in best)).apart(APART * model.wavelength / 2)
        if as_given[tag] and np.trace(maxima.covariances[0]) > (SPACING * model.wavelength) ** 2:
            maxima = _areas(maxima, points, likely[tag])
        places.append(_places(maxima, model.unexplained(maxima.positions, seen[tag])))
    return places


class _Maxima(NamedTuple):
    """Maxima of the likelihood: positions, covariances, and the logarithm of the probability in each maximum."""

    positions: Float[np.ndarray, "M 3"]
    covariances: Float[np.ndarray, "M 3 3"]
    evidence: Float[np.ndarray, " M"]

    def replaced(self, which: Bool[np.ndarray, " M"], others: _Maxima) -> _Maxima:
        """Some of the maxima replaced by others."""
        pairs = zip(self, others, strict=True)
        return _Maxima(*(np.where(which.reshape(-1, *[1] * (a.ndim - 1)), b, a) for a, b in pairs))

    def apart(self, least: float) -> _Maxima:
        """The maxima at least so far apart, in metres, the most probable one first."""
        kept: list[int] = []
        for each in np.argsort(-self.evidence):
            if all(np.linalg.norm(self.positions[each] - self.positions[other]) > least for other in kept):
                kept.append(int(each))
        return _Maxima(*(each[kept] for each in self))


def _starts(
    points: Float[np.ndarray, "G 3"], likely: Float[np.ndarray, " G"], apart: float
) -> Float[np.ndarray, "MODES 3"]:
    """The most likely point, then the next ones that are far enough from all before. The last one may repeat."""
    left, starts = likely.copy(), list[np.ndarray]()
    for _ in range(MODES):
        best = int(left.argmax())
        starts.append(points[best] if left[best] > -np.inf else starts[-1])
        left[np.linalg.norm(points - points[best], axis=1) < apart] = -np.inf
    return np.stack(starts)


def _maximise(
    model: DirectPath, rows: Complex[np.ndarray, "M N"], starts: Float[np.ndarray, "M 3"], box: Float[np.ndarray, "2 3"]
) -> _Maxima:
    """Newton's steps from the starts, and the covariances from the curvature at their ends."""
    free = np.flatnonzero(box[1] > box[0])
    positions, value = starts.copy(), model.log_likelihood_at(starts, rows)
    step = np.full((len(starts), len(free)), STEP * model.wavelength)
    damping = np.ones(len(starts))
    for _ in range(STEPS):
        slope, curvature = _derivatives(model, rows, positions, free, step)
        shares, axes = _eigen(curvature, model.wavelength)
        ahead = np.einsum("mij,mj->mi", axes, np.einsum("mij,mi->mj", axes, slope) / (shares * damping[:, None]))
        length = np.linalg.norm(ahead, axis=1, keepdims=True)
        ahead *= np.minimum(1, model.wavelength / 8 / np.maximum(length, 1e-12))
        moved = positions.copy()
        moved[:, free] += ahead
        away = moved - starts
        away *= np.minimum(1, model.wavelength / np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-12) / 2)
        moved = np.clip(starts + away, *box)
        after = model.log_likelihood_at(moved, rows)
        better = after > value
        positions[better], value[better] = moved[better], after[better]
        damping = np.where(better, np.maximum(damping / 4, 1), damping * 4)
        deviation = 1 / np.sqrt(np.maximum(np.einsum("mii->mi", curvature), 1e-12))
        step = np.clip(deviation / 4, 1e-5 * model.wavelength, STEP * model.wavelength)
    shares, axes = _eigen(_derivatives(model, rows, positions, free, step)[1], model.wavelength)
    covariances = np.zeros((len(starts), 3, 3))
    covariances[:, free[:, None], free] = (axes / shares[:, None]) @ axes.transpose(0, 2, 1)
    return _Maxima(positions, covariances, value - np.log(shares).sum(axis=1) / 2)


def _derivatives(
    model: DirectPath,
    rows: Complex[np.ndarray, "M N"],
    positions: Float[np.ndarray, "M 3"],
    free: np.ndarray,
    step: Float[np.ndarray, "M F"],
) -> tuple[Float[np.ndarray, "M F"], Float[np.ndarray, "M F F"]]:
    """Gradient of the log-likelihood, and minus its second derivatives, by central differences."""
    count = len(free)
    axes = np.eye(count)
    signs = np.array([np.zeros(count), *axes, *-axes, *(a + b for i, a in enumerate(axes) for b in axes[i + 1 :])])
    points = np.repeat(positions[:, None], len(signs), axis=1)
    points[..., free] += signs * step[:, None]
    values = model.log_likelihood_at(points.reshape(-1, 3), np.repeat(rows, len(signs), axis=0))
    values = values.reshape(len(rows), len(signs))
    middle, ahead, behind = values[:, :1], values[:, 1 : count + 1], values[:, count + 1 : 2 * count + 1]
    curvature = np.empty((len(rows), count, count))
    curvature[:, range(count), range(count)] = (2 * middle - ahead - behind) / step**2
    pairs = [(i, j) for i in range(count) for j in range(i + 1, count)]
    for both, (i, j) in zip(values[:, 2 * count + 1 :].T, pairs, strict=True):
        # f(a + b) − f(a) − f(b) + f(0) has the mixed derivative, and third ones that one more point would remove.
        mixed = (both - ahead[:, i] - ahead[:, j] + middle[:, 0]) / (step[:, i] * step[:, j])
        curvature[:, i, j] = curvature[:, j, i] = -mixed
    return (ahead - behind) / (2 * step), curvature


def _eigen(
    curvature: Float[np.ndarray, "M F F"], wavelength: float
) -> tuple[Float[np.ndarray, "M F"], Float[np.ndarray, "M F F"]]:
    """Eigenvalues of the curvature, and its axes. No deviation is larger than a wavelength, over which phases repeat."""
    shares, axes = np.linalg.eigh(curvature)
    return np.maximum(np.abs(shares), 1 / wavelength**2), axes


def _areas(maxima: _Maxima, points: Float[np.ndarray, "G 3"], likely: Float[np.ndarray, " G"]) -> _Maxima:
    """Mean, covariance and probability of the area around each maximum, that is, of the points nearest to it.

    Where the likelihood is broad it has ripples, and the curvature at one of these does not tell how broad it is. Areas
    that a normal distribution would not keep apart become one.
    """
    owner = np.linalg.norm(points[:, None] - maxima.positions, axis=-1).argmin(axis=1)
    weight = np.exp(likely - likely.max())
    masses = np.bincount(owner, weight, len(maxima.positions))
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
    return _Maxima(means, covariances, np.log(masses))


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


def _places(maxima: _Maxima, misfit: Float[np.ndarray, " m"]) -> list[Place]:
    """The places of a tag, the most probable one first."""
    probability = np.exp(maxima.evidence - maxima.evidence.max())
    probability /= probability.sum()
    found = [Place(*each) for each in zip(maxima.positions, maxima.covariances, probability.tolist(), misfit.tolist())]
    return sorted((each for each in found if each.probability >= LEAST_PROBABILITY), key=lambda each: -each.probability)
