"""Does a split leak? How near each test position's nearest training position is, and how alike the two spectra are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.spatial import cKDTree

from learn.metrics import ssim
from simulate.dataset import Dataset
from simulate.spectrum import spectrum_of

LEAKING_SSIM = 0.9
"""A split leaks when the nearest training spectrum has at least this median SSIM with the test spectrum."""


@dataclass(frozen=True)
class Leakage:
    """K test spectra against the spectra at their nearest training positions.

    Attributes:
        distance: from each test position to the nearest training position, metres.
        ssim: SSIM of the nearest training position's spectrum with the test spectrum, at most 1.

    >>> found = Leakage(distance=np.array([0.02, 0.01, 0.03]), ssim=np.array([0.95, 0.97, 0.6]))
    >>> found.ssim_median, found.leaks
    (0.95, True)
    """

    distance: Float[np.ndarray, " K"]
    ssim: Float[np.ndarray, " K"]

    @property
    def ssim_median(self) -> float:
        """Median SSIM of predicting each test spectrum by a copy of the nearest training spectrum."""
        return float(np.median(self.ssim))

    @property
    def leaks(self) -> bool:
        """Whether copying is so good that a score on this split says little about new positions."""
        return self.ssim_median >= LEAKING_SSIM

    def sentence(self) -> str:
        """What was found, in words."""
        near, far = 100 * np.quantile(self.distance, [0.5, 0.9])
        worst, best = np.quantile(self.ssim, [0.1, 0.9])
        return (
            f"half of the test positions have a training position within {near:.1f} cm (nine of ten within {far:.1f} "
            f"cm), and copying its spectrum scores a median SSIM of {self.ssim_median:.3f} (eight of ten between "
            f"{worst:.3f} and {best:.3f})"
            + ("; a score on this split says little about new positions: use the split blocked" if self.leaks else "")
        )


def leakage(dataset: Dataset) -> Leakage | None:
    """Leakage of a dataset's own split, of train_index.txt and test_index.txt.

    Args:
        dataset: a dataset.

    Returns:
        The distances and the likeness; None where the dataset has no training or no test part.
    """
    if not (len(dataset.train) and len(dataset.test)):
        return None
    distance, near = cKDTree(dataset.positions[dataset.train]).query(dataset.positions[dataset.test])
    copies = spectrum_of(dataset.pictures[dataset.train[near]])
    truth = spectrum_of(dataset.pictures[dataset.test])
    return Leakage(distance, ssim(copies, truth))
