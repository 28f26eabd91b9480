"""What was heard of transmitters, and how likely it is from any point: all that the search for their places needs."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator

import numpy as np
from jaxtyping import Bool, Float, Shaped
from scipy.spatial import cKDTree
from scipy.special import logsumexp

from learn.models.base import Report


class Evidence(ABC):
    """What was heard of K transmitters, and its likelihood at points of a region."""

    most = 60_000
    """Largest number of the grid's points; in a larger region they are farther apart."""

    clean = 0.0
    """Misfit below which a broad area may hide a maximum that is far narrower than the grid."""

    numbers: float | None = None
    """Number of independent numbers heard of a transmitter, if the size of their errors is unknown. The likelihood
    then falls as slowly as Student's t distribution, so that only its maxima count, and not its areas."""

    prior: Prior | None = None
    """Where transmitters are before anything is heard. None: anywhere in the region alike."""

    report: Report = staticmethod(lambda phase, done, total: None)
    """Told how far long predictions are."""

    def __init__(
        self,
        heard: Shaped[np.ndarray, "K *each"],
        region: Float[np.ndarray, "2 3"],
        wavelength: float,
        known: Float[np.ndarray, "n 3"] | None = None,
    ):
        self.heard, self.region, self.wavelength = heard, region, wavelength
        self.known = known
        """Positions whose plane or line is that of the transmitters, metres. None: only the region is known."""

    @property
    @abstractmethod
    def told(self) -> Bool[np.ndarray, " K"]:
        """Which transmitters anything was heard of."""

    @abstractmethod
    def log_likelihood(
        self, points: Float[np.ndarray, "n 3"], heard: Shaped[np.ndarray, "k *each"]
    ) -> Iterator[Float[np.ndarray, " n"]]:
        """Logarithm of the likelihood of each transmitter's rows at each point, up to a constant of the transmitter."""

    @abstractmethod
    def misfit(self, points: Float[np.ndarray, "n 3"], row: Shaped[np.ndarray, " *each"]) -> Float[np.ndarray, " n"]:
        """How badly a point explains what was heard of one transmitter; 0 if it explains all."""

    def derivatives(
        self,
        positions: Float[np.ndarray, "M 3"],
        row: Shaped[np.ndarray, " *each"],
        axes: Float[np.ndarray, "d 3"],
        step: Float[np.ndarray, "M d"],
    ) -> tuple[Float[np.ndarray, "M d"], Float[np.ndarray, "M d d"]]:
        """Gradient of the log-likelihood along the axes, and minus its second derivatives, by differences."""
        count, unit = len(axes), np.eye(len(axes))
        signs = np.array([np.zeros(count), *unit, *-unit, *(a + b for i, a in enumerate(unit) for b in unit[i + 1 :])])
        points = positions[:, None] + (signs * step[:, None]) @ axes
        values = next(self.log_likelihood(points.reshape(-1, 3), row[None])).reshape(len(positions), len(signs))
        middle, ahead, behind = values[:, :1], values[:, 1 : count + 1], values[:, count + 1 : 2 * count + 1]
        curvature = np.empty((len(positions), count, count))
        curvature[:, range(count), range(count)] = (2 * middle - ahead - behind) / step**2
        pairs = [(i, j) for i in range(count) for j in range(i + 1, count)]
        for both, (i, j) in zip(values[:, 2 * count + 1 :].T, pairs, strict=True):
            # f(a + b) − f(a) − f(b) + f(0) has the mixed derivative, and third ones that one more point would remove.
            mixed = (both - ahead[:, i] - ahead[:, j] + middle[:, 0]) / (step[:, i] * step[:, j])
            curvature[:, i, j] = curvature[:, j, i] = -mixed
        return (ahead - behind) / (2 * step), curvature

    def unlike(self) -> Float[np.ndarray, "K n"] | None:
        """How unlike the known rows what was heard is, for copying their positions. None: no rows are known."""
        return None


WIDTH = 0.125
"""Least standard deviation of a transmitter's distance from a known position, wavelengths. If known positions are
farther apart, it is the distance of neighbours."""

NEIGHBOURS = 16  # Number of nearest known positions in the sum

ELSEWHERE = 1e-6  # Density far from all known positions, relative to that at one of them


class Prior:
    """Density of transmitters: normal distributions around the known positions."""

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
