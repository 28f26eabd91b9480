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
    """What became of the 90 % intervals of some spectra's values."""

    spectra: int  # number of spectra
    share: float  # share of the true values that are within their intervals
    width: float  # mean width of the intervals; the values themselves are from 0 to 1

    @classmethod
    def of(
        cls, errors_in_deviations: Float[np.ndarray, "K P"], deviation: Float[np.ndarray, " K"]
    ) -> StatedIntervals | None:
        """Count the errors within the intervals. None: no deviation is stated, or none is finite."""
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
    """The intervals of each band of distances that has any, with the band in words."""
    for words, band in distance_bands(wavelengths):
        found = StatedIntervals.of(errors_in_deviations[band], deviation[band])
        if found is not None:
            yield words, found
