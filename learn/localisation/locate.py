"""Locate transmitters from their spectra: compare with a field over a grid, then refine the best positions."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from functools import partial

import numpy as np
from jaxtyping import Float, UInt8
from scipy.spatial import cKDTree
from scipy.special import logsumexp

from learn.localisation.fingerprints import Field
from learn.localisation.located_places import LEAST_PROBABILITY, Place
from learn.localisation.refine import FARTHEST, MODES, Refined, candidate_points, grid_in, refine
from learn.models.base import Report
from learn.training.run_folder import Run
from scenes.files.errors import InputError, ParameterError, shown
from simulate.positions.positions import check_points
from simulate.spectra.spectrum import check_pictures, evenly

SPACING = 0.125
"""Wavelengths between the grid's points. Fingerprints change completely within a quarter of a wavelength."""

MOST_POINTS = 60_000  # Largest number of points of the grid; in a larger region they are farther apart

APART = 0.5
"""Least distance of two starting points of a transmitter, wavelengths. Refined positions closer than half of it count
as one."""

TOLD = 1 / 4
"""Share of the spectra's numbers whose errors are independent; errors of neighbouring elements are similar."""

LEAST_MISFIT = 1e-4  # Misfit that rounding the pictures causes


def locate(
    runs: Sequence[Run],
    pictures: Sequence[UInt8[np.ndarray, "K 90 360"]],
    report: Report = lambda phase, done, total: None,
    known: Float[np.ndarray, "n 3"] | None = None,
) -> list[list[Place]]:
    """Locate transmitters from their spectra.

    Each run predicts spectra over a grid in the region of its training positions, and at these positions. The positions
    with the most similar spectra are then refined (Levenberg–Marquardt). The comparison uses fingerprints: spectra
    whose scale and offset are removed, so that only their shape counts.

    The probability of a place is proportional to ``misfit^(−n/2)`` times the density of training positions, where n is
    the number of independent numbers in the spectra. This is the likelihood of normal errors of unknown size.

    Args:
        runs: a trained run for each gateway, all in one world frame.
        pictures: for each gateway its pictures [K, 90, 360] of the same K transmitters, grey levels 0…255 or spectra
            0…1.
        report: called with the phase, the number of positions done, and the number of all positions.
        known: [n, 3] training positions of the first run, metres, world frame. None: they are read from its dataset.

    Returns:
        The places of each transmitter, the most probable one first. A transmitter whose pictures have a single grey
        level has none.

    Raises:
        ParameterError: there are no runs, one twice, or not as many arrays of pictures; or pictures are not stacks of
            the same number of pictures.
        InputError: the training positions of the runs have no region in common, or the first run's dataset, which has
            these positions, cannot be read.

    Example:
        >>> import bisplat
        >>> run, data = bisplat.load_run("runs/lab"), bisplat.read_dataset("data/lab")
        >>> places = locate([run], [data.pictures[data.test[:2]]])
        >>> len(places), places[0][0].position.shape
        (2, (3,))
    """
    runs = _checked_runs(runs)
    pictures = _checked_pictures(pictures, len(runs))
    if known is not None:
        known = check_points(known, "known")
    region, wavelength = common_region(runs), float(runs[0].model.wavelength)
    field = Field(runs)
    numbers = TOLD * field.numbers
    if known is None:
        data = runs[0].dataset()
        known = data.positions[runs[0].split(data).known]
    prior = Prior(known, wavelength)
    seen = field.of_pictures(pictures)
    inside = ((known >= region[0]) & (known <= region[1])).all(axis=1)
    points = np.concatenate([grid_in(region, SPACING * wavelength, MOST_POINTS), evenly(known[inside], MOST_POINTS)])
    there = field.predicted(points, partial(report, "field on a grid"))
    density = prior(points)

    def likely(fingerprint: Float[np.ndarray, " F"]) -> Float[np.ndarray, " n"]:
        misfit = np.maximum(0, 2 - 2 * there @ fingerprint)
        return density - numbers / 2 * np.log(LEAST_MISFIT + misfit)

    found: list[list[Place]] = []
    for number, fingerprint in enumerate(seen):
        report("positions", number, len(seen))
        if not fingerprint.any():
            found.append([])
            continue
        starts = candidate_points(points, likely(fingerprint), APART * wavelength)
        refined = refine(field.predicted, np.tile(fingerprint, (MODES, 1)), starts, region, wavelength)
        found.append(_places(refined, prior, numbers, region, wavelength))
    return found


def _checked_runs(runs: Sequence[Run]) -> list[Run]:
    if not isinstance(runs, Sequence) or not runs or not all(isinstance(run, Run) for run in runs):
        raise ParameterError("runs", f"expected a list with a run for each gateway, found {shown(runs)}")
    folders = [run.folder.resolve() for run in runs]
    if len(set(folders)) < len(folders):
        twice = Counter(folders).most_common(1)[0][0]
        raise ParameterError("runs", f"expected a run for each gateway, found {twice} twice")
    return list(runs)


def _checked_pictures(pictures: Sequence[np.ndarray], count: int) -> list[np.ndarray]:
    """A stack of pictures for each of ``count`` gateways, all of the same number of transmitters."""
    if not isinstance(pictures, Sequence) or len(pictures) != count:
        found = f"{len(pictures)} of them" if isinstance(pictures, Sequence | np.ndarray) else shown(pictures)
        raise ParameterError("pictures", f"expected a list with an array for each of the {count} runs, found {found}")
    checked = [check_pictures("pictures", each) for each in pictures]
    if len({len(each) for each in checked}) > 1:
        found = " and ".join(str(len(each)) for each in checked)
        raise ParameterError("pictures", f"expected pictures of the same transmitters, found {found}")
    return checked


def grid_warning(runs: Sequence[Run]) -> str | None:
    """A warning about a region so large that the grid may miss a transmitter. None: there is no such risk."""
    region, wavelength = common_region(runs), float(runs[0].model.wavelength)
    points = grid_in(region, SPACING * wavelength, MOST_POINTS)
    widest = max(float(np.diff(np.unique(axis)).max(initial=0)) for axis in points.T) / wavelength
    if widest <= FARTHEST:
        return None
    return (
        f"the {len(points)} grid points in this large region are {widest:.2g} wavelengths apart; beyond {FARTHEST:g}, "
        "transmitters between them may be missed unless they are near training positions"
    )


def common_region(runs: Sequence[Run]) -> Float[np.ndarray, "2 3"]:
    """Corners (min, max) of the box that the training positions of all runs share, metres, world frame."""
    boxes = np.stack([run.model.region.double().cpu().numpy() for run in runs])
    region = np.stack([boxes[:, 0].max(axis=0), boxes[:, 1].min(axis=0)])
    if (region[0] > region[1]).any():
        raise InputError(
            f"{runs[-1].folder}: expected runs that were trained in one region, found no place that the regions of all "
            "runs share"
        )
    return region


def _places(
    refined: Refined, prior: Prior, numbers: float, region: Float[np.ndarray, "2 3"], wavelength: float
) -> list[Place]:
    """The distinct places among the refined positions of a transmitter, the most probable one first."""
    positions, misfit, normal = refined
    order = [int(each) for each in misfit.argsort()]
    kept: list[int] = []
    for each in order:
        if all(np.linalg.norm(positions[each] - positions[other]) > APART * wavelength / 2 for other in kept):
            kept.append(each)
    # The derivatives say nothing about places more than a wavelength away, so no deviation is larger than that.
    variance = (LEAST_MISFIT + misfit[kept]) / max(numbers - 3, 1)
    precision = normal[kept] / variance[:, None, None] + np.eye(3) / wavelength**2
    free = np.flatnonzero(region[1] > region[0])
    covariance = np.zeros_like(precision)
    covariance[:, free[:, None], free] = np.linalg.inv(precision[:, free[:, None], free])
    # The volume that a place's covariance spans would be a further factor. Measured data are located worse with it,
    # since the field is flat where it is wrong.
    likelihood = -numbers / 2 * np.log(LEAST_MISFIT + misfit[kept])
    likelihood += prior(positions[kept])
    probability = np.exp(likelihood - likelihood.max())
    probability /= probability.sum()
    places = [
        Place(positions[each], covariance[row], float(probability[row]), float(misfit[each]))
        for row, each in enumerate(kept)
        if probability[row] >= LEAST_PROBABILITY
    ]
    return sorted(places, key=lambda place: -place.probability)


WIDTH = 0.125
"""Least standard deviation of a transmitter's distance from a training position, wavelengths. If training positions are
farther apart, it is the distance of neighbours."""

NEIGHBOURS = 16  # Number of nearest training positions in the sum

ELSEWHERE = 1e-6  # Density far from all training positions, relative to that at one of them


class Prior:
    """Density of transmitters: normal distributions around the training positions."""

    def __init__(self, known: Float[np.ndarray, "n 3"], wavelength: float):
        self._tree, self._count = cKDTree(known), min(NEIGHBOURS, len(known))
        apart = self._tree.query(known, k=min(2, len(known)))[0].reshape(len(known), -1)[:, -1]
        self._width = max(WIDTH * wavelength, float(np.median(apart)))

    def __call__(self, positions: Float[np.ndarray, "K 3"]) -> Float[np.ndarray, " K"]:
        """Logarithm of the density at positions (metres, world frame), up to a constant.

        >>> density = Prior(np.zeros((1, 3)), 0.32)
        >>> density(np.array([[0.0, 0, 0], [0.04, 0, 0], [9, 0, 0]])).round(1).tolist()
        [0.0, -0.5, -13.8]
        """
        distance = self._tree.query(positions, k=self._count)[0].reshape(len(positions), -1)
        near = logsumexp(-((distance / self._width) ** 2) / 2, axis=1)
        return np.logaddexp(near, np.log(ELSEWHERE))
