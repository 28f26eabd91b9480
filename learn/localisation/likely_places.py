"""Places from the likelihood of points: the mean and the covariance of each cluster of likely points."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from scipy.spatial import cKDTree

from learn.localisation.locate import LEAST_PROBABILITY, Place

CLEARLY_APART = 5.0
"""Ashman's D from which two clusters are two places. It is 2.7 for the halves of a normal density, 3.5 for those of a
uniform one. From 4 on, ripples of fading would count as places of their own."""

SPLITS = 2
"""How often the points are split in two; so at most four places are found."""

LEAST_WEIGHT = 1e-6
"""Points with a smaller share of the largest weight are left out."""

ROUNDS = 20
"""Largest number of rounds of the clustering."""


def cell_variance(points: Float[np.ndarray, "n 3"]) -> float:
    """Variance of a position within the cell of its point, m²: the square of the median distance of neighbours."""
    if len(points) < 2:
        return 0.0
    return float(np.median(cKDTree(points).query(points, k=2)[0][:, 1])) ** 2


def likely_places(
    points: Float[np.ndarray, "n 3"], likely: Float[np.ndarray, " n"], misfit: Float[np.ndarray, " n"], cell: float
) -> list[Place]:
    """The places where a transmitter may be.

    The mean of all likely points has the least mean square error, as long as they are in one cluster. They are split in
    two (by 2-means) where both parts are clearly apart on the line between their means: where Ashman's D = √2
    ``|m₁ − m₂|`` / √(s₁² + s₂²) is above 5 [ashman1994].

    >>> line = np.linspace(0, 1, 50)[:, None] * [1, 0, 0]
    >>> [place] = likely_places(line, np.zeros(50), np.zeros(50), 1e-4)
    >>> place.position.round(2).tolist(), place.probability
    ([0.5, 0.0, 0.0], 1.0)
    >>> ends = likely_places(line, -1e3 * (line[:, 0] * (1 - line[:, 0])), np.zeros(50), 1e-4)
    >>> [round(place.probability, 2) for place in ends]
    [0.5, 0.5]
    """
    weights = np.exp(likely - likely.max())
    kept = np.flatnonzero(weights > LEAST_WEIGHT)
    groups = [kept]
    for _ in range(SPLITS):
        groups = [part for group in groups for part in _parts(points[group], weights[group], cell, group)]
    total = weights[kept].sum()
    places = []
    for group in groups:
        weight = weights[group]
        mean = np.average(points[group], axis=0, weights=weight)
        away = points[group] - mean
        covariance = (away.T * weight) @ away / weight.sum() + cell * np.eye(3)
        best = group[int(weight.argmax())]
        places.append(Place(mean, covariance, float(weight.sum() / total), float(misfit[best])))
    return sorted(places, key=lambda place: -place.probability)


def _parts(
    points: Float[np.ndarray, "m 3"], weights: Float[np.ndarray, " m"], cell: float, group: np.ndarray
) -> list[np.ndarray]:
    """The group as it is, or its two parts if they are clearly apart."""
    if len(points) < 2:
        return [group]
    centre = np.average(points, axis=0, weights=weights)
    axis = np.linalg.svd((points - centre) * np.sqrt(weights)[:, None], full_matrices=False)[2][0]
    second = (points - centre) @ axis > 0
    means = np.zeros((2, 3))
    for _ in range(ROUNDS):
        if not 0 < second.sum() < len(second):
            return [group]
        means = np.stack([np.average(points[each], axis=0, weights=weights[each]) for each in (~second, second)])
        nearer = np.linalg.norm(points - means[1], axis=1) < np.linalg.norm(points - means[0], axis=1)
        if (nearer == second).all():
            break
        second = nearer
    shares = np.array([weights[~second].sum(), weights[second].sum()]) / weights.sum()
    apart = means[1] - means[0]
    distance = float(np.linalg.norm(apart))
    if shares.min() < LEAST_PROBABILITY or not distance:
        return [group]
    along = points @ (apart / distance)
    spreads = [_variance(along[each], weights[each]) + cell for each in (~second, second)]
    if np.sqrt(2) * distance <= CLEARLY_APART * np.sqrt(sum(spreads)):
        return [group]
    return [group[~second], group[second]]


def _variance(values: Float[np.ndarray, " m"], weights: Float[np.ndarray, " m"]) -> float:
    return float(np.average(np.square(values - np.average(values, weights=weights)), weights=weights))
