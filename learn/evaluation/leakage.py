"""Does a split leak? How near each test spectrum's nearest training spectrum is, and how alike."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.spatial import cKDTree

from learn.metrics import ssim
from simulate.dataset import Dataset

COPYING_IS_ENOUGH = 0.9
"""A split leaks when the nearest training spectrum has at least this median SSIM with the test spectrum."""


@dataclass(frozen=True)
class Leakage:
    """Test spectra against their nearest training spectra.

    Attributes:
        distance: from each test position to the nearest training position, metres.
        ssim: of the nearest training spectrum with the test spectrum.
    """

    distance: Float[np.ndarray, " K"]
    ssim: Float[np.ndarray, " K"]

    @property
    def ssim_median(self) -> float:
        """Score of copying."""
        return float(np.median(self.ssim))

    @property
    def leaks(self) -> bool:
        return self.ssim_median >= COPYING_IS_ENOUGH

    def sentence(self) -> str:
        """What was found, for a reader who never thought of it."""
        near, far = 100 * np.quantile(self.distance, [0.5, 0.9])
        worst, best = np.quantile(self.ssim, [0.1, 0.9])
        return (
            f"half of the test positions have a training position within {near:.1f} cm (nine of ten within {far:.1f} "
            f"cm), and copying its spectrum scores a median SSIM of {self.ssim_median:.3f} (eight of ten between "
            f"{worst:.3f} and {best:.3f})"
            + ("; a score on this split says little: use train --split blocked" if self.leaks else "")
        )


def leakage(dataset: Dataset) -> Leakage | None:
    """Leakage of the folder's own split; None where it has no training or no test part."""
    if not (len(dataset.train) and len(dataset.test)):
        return None
    distance, near = cKDTree(dataset.positions[dataset.train]).query(dataset.positions[dataset.test])
    copies = dataset.pictures[dataset.train[near]] / 255.0
    truth = dataset.pictures[dataset.test] / 255.0
    return Leakage(distance, ssim(copies, truth))
