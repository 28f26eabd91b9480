"""Leakage of a split: how near test positions are to training positions, and how similar their spectra are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.spatial import cKDTree

from learn.data.metrics import ssim_of_each
from learn.data.splits import Split, SplitKind
from simulate.dataset.dataset import Dataset
from simulate.spectra.spectrum import evenly, spectrum_of

LEAKING_SSIM = 0.9
"""A split leaks if the median SSIM of test spectra and their nearest training spectra is at least this high."""

COMPARED, AT_ONCE = 2000, 100
"""Largest number of compared test spectra, evenly spread over the test part, and number of them in memory at once."""


@dataclass(frozen=True)
class Leakage:
    """K test spectra compared with the spectra at their nearest known positions.

    Known positions are those of the training and the validation part. A folder's own split has no validation part.

    Attributes:
        distance: [K] distance from each test position to the nearest known position, metres.
        ssim: [K] SSIM of each test spectrum and the spectrum at the nearest known position, at most 1.

    Example:
        >>> found = Leakage(distance=np.array([0.02, 0.01, 0.03]), ssim=np.array([0.95, 0.97, 0.6]))
        >>> found.ssim_median, found.leaks
        (0.95, True)
    """

    distance: Float[np.ndarray, " K"]
    ssim: Float[np.ndarray, " K"]

    @property
    def ssim_median(self) -> float:
        """Median SSIM of predicting each test spectrum by a copy of the nearest known spectrum."""
        return float(np.median(self.ssim))

    @property
    def leaks(self) -> bool:
        """Whether this median is at least 0.9, so that a score on this split says little about new positions."""
        return self.ssim_median >= LEAKING_SSIM

    def facts(self) -> str:
        """Distances and similarity in one sentence."""
        distance_median, distance_p90 = 100 * np.quantile(self.distance, [0.5, 0.9])
        return (
            f"half of the test positions have a known position within {distance_median:.1f} cm (nine of ten within "
            f"{distance_p90:.1f} cm), and copying its spectrum "
            f"scores {self.similarity()}"
        )

    def similarity(self) -> str:
        """The SSIM of copying the nearest known spectrum in words."""
        ssim_p10, ssim_p90 = np.quantile(self.ssim, [0.1, 0.9])
        return f"a median SSIM of {self.ssim_median:.3f} (eight of ten between {ssim_p10:.3f} and {ssim_p90:.3f})"

    def warning(self, split: SplitKind | None = None) -> str:
        """Distances and similarity, with what follows if the split leaks.

        Args:
            split: the split. None: the dataset's own.
        """
        if split in ("blocked", "area"):
            better = "leave near positions out with --guard" + (", or use the split area" if split == "blocked" else "")
        else:
            better = "use the split blocked (from 21 spectra on)"
        return f"{self.facts()}; a score on this split says little about new positions: {better}"


def leakage(dataset: Dataset, parts: Split | None = None) -> Leakage | None:
    """Leakage of a split of a dataset."""
    known, tested = (dataset.train, dataset.test) if parts is None else (parts.known, parts.test)
    if not (len(known) and len(tested)):
        return None
    test = evenly(tested, COMPARED)
    distance, nearest = cKDTree(dataset.positions[known]).query(dataset.positions[test])
    copied = known[nearest]
    similar = np.empty(len(test))
    for some in np.array_split(np.arange(len(test)), -(-len(test) // AT_ONCE)):
        copies, truth = (spectrum_of(dataset.pictures[indices[some]]) for indices in (copied, test))
        similar[some] = ssim_of_each(copies, truth)
    return Leakage(distance, similar)
