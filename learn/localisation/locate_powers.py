"""Locate transmitters from the powers (RSSI) that several gateways receive, by a survey of known positions."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import cKDTree
from scipy.special import log_ndtr, logsumexp, ndtri

from learn.localisation.located_places import LEAST_PROBABILITY, Place
from learn.models.base import Report
from learn.powers.fit_powers import fit_powers
from learn.quantities.quantity import Prediction
from scenes.files.errors import ParameterError, check_array, require_instance, require_seed, require_within
from scenes.files.plain_text import say
from scenes.scene.shapes import bounding_box
from simulate.rssi.power_receiver import NOT_RECEIVED, fault_of_powers
from simulate.rssi.rssi_dataset import RssiDataset, read_rssi
from simulate.spectra.spectrum import evenly

CLEARLY_APART = 5.0
"""Ashman's D from which two clusters are two places. It is 2.7 for the halves of a normal density, 3.5 for those of a
uniform one. From 4 on, ripples of fading would count as places of their own."""

SPLITS = 2  # How often the points are split in two; so at most four places are found

LEAST_WEIGHT = 1e-6  # Points with a smaller share of the largest weight are left out

ROUNDS = 20  # Largest number of rounds of the clustering


def cell_variance(points: Float[np.ndarray, "n 3"]) -> float:
    """Variance of a position within the cell of its point, m²: the square of the median distance of neighbours."""
    if len(points) < 2:
        return 0.0
    return float(np.median(cKDTree(points).query(points, k=2)[0][:, 1])) ** 2


def posterior_places(
    points: Float[np.ndarray, "n 3"], likely: Float[np.ndarray, " n"], misfit: Float[np.ndarray, " n"], cell: float
) -> list[Place]:
    """The places where a transmitter may be.

    The mean of all likely points has the least mean square error, as long as they are in one cluster. They are split in
    two (by 2-means) where both parts are clearly apart on the line between their means: where Ashman's D = √2
    ``|m₁ − m₂|`` / √(s₁² + s₂²) is above 5 [ashman1994].
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


END = float(ndtri(0.95))  # Ends of the 90 % interval of a normal distribution, standard deviations

LEAST_DEVIATION = 0.5
"""Least standard deviation of a predicted power, dB. Gateways report powers in steps of about 1 dB."""

POINTS = 2000
"""Number of points where a transmitter may be. With four times as many, places in an office were no nearer."""

LEVELS = np.arange(-20.0, 21.0)  # Levels that are tried where none is stated, dB

LEVEL_SPREAD = 6.0  # Standard deviation of the level of a device before anything is heard, dB

LEAST_GAIN = 2.0
"""Least gain in the logarithm of the probability for which a level other than 0 is taken."""

LEVEL_ROWS = 50  # Largest number of transmitters from which the level is estimated

LEVEL_MOST = 60.0  # Largest level that can be stated, dB


class PowerLikelihood:
    """Likelihood of received powers at points, where a survey predicts them with an interval.

    The density about the predicted median is the split normal one: deviations below and above it are those of the two
    ends of the 90 % interval, since fading is skewed. A power that was not received is one below the floor. The errors
    of different gateways are independent.
    """

    def __init__(self, predicted: Prediction, floor: float):
        assert predicted.low is not None and predicted.high is not None
        self._median, self._floor = predicted.value, floor
        self._below = np.maximum((predicted.value - predicted.low) / END, LEAST_DEVIATION)
        self._above = np.maximum((predicted.high - predicted.value) / END, LEAST_DEVIATION)

    def __call__(self, powers: Float[np.ndarray, " G"], level: float) -> Float[np.ndarray, " n"]:
        """Logarithm of the likelihood of a transmitter's powers at each point, up to a constant."""
        heard = ~np.isnan(powers)
        stated = np.where(self._over(powers, level) > 0, self._above, self._below)
        error = self._over(powers, level) / stated
        seen = -np.square(error) / 2 - np.log(self._below + self._above)
        return np.where(heard, seen, self._below_floor(level)).sum(axis=1)

    def misfit(self, powers: Float[np.ndarray, " G"], level: float) -> Float[np.ndarray, " n"]:
        """Mean square of the received powers' errors at each point, in stated standard deviations."""
        over = self._over(powers, level)
        return np.nanmean(np.square(over / np.where(over > 0, self._above, self._below)), axis=1)

    def _over(self, powers: Float[np.ndarray, " G"], level: float) -> Float[np.ndarray, "n G"]:
        return powers - level - self._median

    def _below_floor(self, level: float) -> Float[np.ndarray, "n G"]:
        """Logarithm of the probability that a power is below the floor."""
        over = self._floor - level - self._median
        share = 2 / (self._below + self._above)
        above = share * self._above * np.exp(log_ndtr(-np.maximum(over, 0) / self._above))
        below = np.log(share * self._below) + log_ndtr(np.minimum(over, 0) / self._below)
        return np.where(over > 0, np.log1p(-above), below)


def locate_powers(
    dataset: RssiDataset | Path | str,
    heard: Float[np.ndarray, "K G"],
    *,
    known: Int[np.ndarray, " n"] | None = None,
    level: float | None = None,
    seed: int = 0,
    report: Report = lambda phase, done, total: None,
) -> list[list[Place]]:
    """Locate transmitters from their received powers (RSSI), by a survey of powers at known positions.

    The method ``helmholtz`` of ``fit_powers`` predicts the powers at 2000 points in the box around the known positions,
    with intervals. Bayes' rule with equal prior probability of all points gives the places: the mean and the
    covariance of the likely points. A power that was not received counts as one below the dataset's floor.

    All heard transmitters are taken for one device, whose level may differ from the survey's by a constant in dB. If it
    is not stated, the most probable one is estimated from all of them, and printed.

    Args:
        dataset: the survey, or its folder.
        heard: [K, G] powers of the K transmitters in dBm, in the order of ``dataset.gateway_names``; NaN (or −100)
            where nothing was received.
        known: indices of the survey's positions to use. None: all of them.
        level: how much stronger the heard device is than that of the survey, dB. 0: it is the same. None: estimated.
        seed: seed of the points.
        report: called with the phase, the number of transmitters done, and the number of all.

    Returns:
        The places of each transmitter, the most probable one first. Their ``misfit`` is the mean square of the powers'
        errors in stated standard deviations. A transmitter that no gateway received has none.

    Raises:
        InputError: the folder cannot be read.
        ParameterError: ``heard`` is not an array of powers with a column for each gateway, or another argument is out
            of its range.

    Example:
        >>> import bisplat, numpy as np
        >>> places = np.random.default_rng(0).uniform(0, 4, (60, 3))
        >>> ends = {"a": (0, 0, 5), "b": (4, 0, 5), "c": (0, 4, 5), "d": (4, 4, 0)}
        >>> powers = -40 - 20 * np.log10(np.linalg.norm(places[:, None] - list(ends.values()), axis=2))
        >>> hall = bisplat.write_rssi("arena", places, powers, ends, "2.4 GHz")
        >>> [found] = bisplat.locate_powers(hall, powers[:1], known=np.arange(1, 60), level=0)
        >>> bool(np.linalg.norm(found[0].position - places[0]) < 0.5)
        True
    """
    return located_by_powers(dataset, heard, known, level, seed, report)[0]


def located_by_powers(
    dataset: RssiDataset | Path | str,
    heard: Float[np.ndarray, "K G"],
    known: Int[np.ndarray, " n"] | None,
    level: float | None,
    seed: int = 0,
    report: Report = lambda phase, done, total: None,
) -> tuple[list[list[Place]], float]:
    """As ``locate_powers``, and the level that was stated or estimated, dB."""
    require_instance(RssiDataset, str, PathLike, dataset=dataset)
    require_seed(seed=seed)
    if level is not None:
        require_within(-LEVEL_MOST, LEVEL_MOST, "dB", level=level)
    dataset = dataset if isinstance(dataset, RssiDataset) else read_rssi(dataset)
    powers = _checked(heard, len(dataset.gateway_names))
    fitted = fit_powers(dataset, known=known, seed=seed)
    points = points_among(dataset.positions[fitted.known], seed)
    likelihood = PowerLikelihood(fitted.predict(points), dataset.floor_dbm)
    received = ~np.isnan(powers).all(axis=1)
    if level is None:
        level = estimated_level(likelihood, powers[received])
        than = f"{abs(level):g} dB {'stronger' if level > 0 else 'weaker'} than" if level else "as strong as"
        say(f"took all heard powers for those of one device, {than} that of the survey")
    cell = cell_variance(points)
    found: list[list[Place]] = []
    for number, row in enumerate(powers):
        report("positions", number, len(powers))
        likely = likelihood(row, level)
        found.append(posterior_places(points, likely, likelihood.misfit(row, level), cell) if received[number] else [])
    return found, level


def points_among(known: Float[np.ndarray, "n 3"], seed: int) -> Float[np.ndarray, "N 3"]:
    """Points drawn uniformly in the box around known positions, metres. The hull of a few would be too small."""
    low, high = bounding_box(known)
    return np.random.default_rng(seed).uniform(low, high, (POINTS, 3))


def estimated_level(likelihood: PowerLikelihood, powers: Float[np.ndarray, "K G"]) -> float:
    """The most probable level of a device that sent at K unknown places, dB; 0 if no other is clearly more probable."""
    chosen = evenly(powers, LEVEL_ROWS)
    gains = np.array([sum(logsumexp(likelihood(row, level)) for row in chosen) for level in LEVELS])
    gains -= np.square(LEVELS / LEVEL_SPREAD) / 2
    best = int(gains.argmax())
    same = gains[int(np.flatnonzero(LEVELS == 0)[0])]
    return float(LEVELS[best]) if gains[best] - same > LEAST_GAIN else 0.0


def _checked(heard: Float[np.ndarray, "K G"], gateways: int) -> Float[np.ndarray, "K G"]:
    what = f"powers in dBm with a column for each of the {gateways} gateways"
    powers = check_array("heard", heard, (None, gateways), what, finite=False)
    if not len(powers):
        raise ParameterError("heard", f"expected {what}, found no row")
    if np.isinf(powers).any():
        raise ParameterError("heard", f"expected {what}, NaN where nothing was received, found an infinite one")
    powers[powers == NOT_RECEIVED] = np.nan
    if fault := fault_of_powers(powers):
        raise ParameterError("heard", fault)
    return powers
