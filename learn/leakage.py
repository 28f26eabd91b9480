"""Does a split leak? How near each test spectrum's nearest training spectrum is, and how alike."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from learn.metrics import ssim
from simulate.dataset import Dataset

COPYING_IS_ENOUGH = 0.9
"""A split leaks when the nearest training spectrum has at least this median SSIM with the test spectrum."""


@dataclass(frozen=True)
class Leakage:
    """Test spectra against their nearest training spectra.

    Attributes:
        distance_median: metres.
        ssim_median: score of copying.
    """

    distance_median: float
    ssim_median: float

    @property
    def leaks(self) -> bool:
        return self.ssim_median >= COPYING_IS_ENOUGH

    def sentence(self) -> str:
        """What was found, for a reader who never thought of it."""
        return (
            f"a test position's nearest training position is {100 * self.distance_median:.1f} cm away (median), and "
            f"copying its spectrum scores a median SSIM of {self.ssim_median:.3f}"
            + ("; a score on this split says little: use train --split blocked" if self.leaks else "")
        )


def leakage(dataset: Dataset) -> Leakage | None:
    """Leakage of the folder's own split; None where it has no training or no test part."""
    if not (len(dataset.train) and len(dataset.test)):
        return None
    distance, near = cKDTree(dataset.positions[dataset.train]).query(dataset.positions[dataset.test])
    copies = dataset.pictures[dataset.train[near]] / 255.0
    truth = dataset.pictures[dataset.test] / 255.0
    return Leakage(float(np.median(distance)), float(np.median(ssim(copies, truth))))
