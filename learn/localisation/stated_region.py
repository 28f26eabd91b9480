"""Whether the true position lies in the region that a place's covariance states."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from scipy.stats import chi2

from learn.localisation.locate import Place
from learn.planning.candidates import extended_axes

REGION = 0.9
"""Probability of the stated region."""

LEAST_VARIANCE = 1e-12
"""Square metres: along an axis where a covariance is 0, a micrometre off is outside."""


def share_in_region(
    places: Sequence[Place], truth: Float[np.ndarray, "K 3"], known: Float[np.ndarray, "n 3"]
) -> float | None:
    """Share of the true positions that lie in the stated region of ``REGION``.

    The region is the ellipsoid of the covariance. Only the axes count along which the known positions extend: in a
    survey at one height, the height is no news, and the region is an ellipse.

    >>> place = Place(np.zeros(3), np.eye(3), 1.0, 0.0)
    >>> flat, solid = np.vstack([np.eye(3)[:2], np.zeros(3)]), np.vstack([np.eye(3), -np.eye(3)])
    >>> truth = np.array([[2.3, 0, 0]])  # beyond the ellipse's 2.1, within the ellipsoid's 2.5
    >>> share_in_region([place], truth, flat), share_in_region([place], truth, solid)
    (0.0, 1.0)
    """
    axes = extended_axes(known)[1]
    if not len(axes) or not len(places):
        return None
    away = (np.stack([place.position for place in places]) - truth) @ axes.T
    covariances = axes @ np.stack([place.covariance for place in places]) @ axes.T + LEAST_VARIANCE * np.eye(len(axes))
    squared = np.einsum("ki,ki->k", away, np.linalg.solve(covariances, away[..., None])[..., 0])
    return float(np.mean(squared <= chi2.ppf(REGION, len(axes))))
