"""Prior density of transmitters, before any spectrum is seen: near the training positions."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from scipy.spatial import cKDTree
from scipy.special import logsumexp

WIDTH = 0.125
"""Least standard deviation of a transmitter's distance from a training position, wavelengths. If training positions are
farther apart, it is the distance of neighbours."""

NEIGHBOURS = 16
"""Number of nearest training positions in the sum."""

ELSEWHERE = 1e-6
"""Density far from all training positions, relative to that at one of them."""


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
