"""How many of the true values lie within the stated 90 % intervals, by the distance to the nearest known position."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from learn.data.split_distances import distance_bands
from learn.models.kriging.deviation_curve import NORMAL


@dataclass(frozen=True)
class StatedIntervals:
    """What became of the 90 % intervals of some spectra's values.

    Attributes:
        spectra: number of spectra.
        share: share of the true values that are within their intervals.
        width: mean width of the intervals; the values themselves are from 0 to 1.

    Example:
        >>> errors, deviation = np.array([[0.5, 2.0], [1.0, 1.0]]), np.array([0.1, 0.2])
        >>> StatedIntervals.of(errors, deviation)
        StatedIntervals(spectra=2, share=0.75, width=0.493...)
    """

    spectra: int
    share: float
    width: float

    @classmethod
    def of(
        cls, errors_in_deviations: Float[np.ndarray, "K P"], deviation: Float[np.ndarray, " K"]
    ) -> StatedIntervals | None:
        """Count the errors within the intervals. None: no deviation is stated, or none is finite.

        Args:
            errors_in_deviations: absolute errors at P pixels, divided by the deviation.
            deviation: the stated deviation of each spectrum; nan far from everything known.
        """
        told = np.isfinite(deviation)
        if not told.any():
            return None
        share, width = (errors_in_deviations[told] <= NORMAL).mean(), 2 * NORMAL * deviation[told].mean()
        return cls(int(told.sum()), float(share), float(width))

    def facts(self) -> dict[str, Any]:
        """The numbers for JSON and tables."""
        return {"spectra": self.spectra, "within_90_percent_interval": self.share, "interval_width_mean": self.width}


def intervals_by_distance(
    errors_in_deviations: Float[np.ndarray, "K P"],
    deviation: Float[np.ndarray, " K"],
    wavelengths: Float[np.ndarray, " K"],
) -> Iterator[tuple[str, StatedIntervals]]:
    """The intervals of each band of distances that has any, with the band in words.

    Example:
        >>> list(intervals_by_distance(np.array([[0.5]]), np.array([0.1]), np.array([3.0])))
        [('over 2 λ', StatedIntervals(spectra=1, share=1.0, width=0.328...))]
    """
    for words, band in distance_bands(wavelengths):
        found = StatedIntervals.of(errors_in_deviations[band], deviation[band])
        if found is not None:
            yield words, found
