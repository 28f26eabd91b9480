"""How far the test positions of a split are from the known ones, and how similar their spectra are (leakage)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float
from scipy.spatial import cKDTree

from learn.data.metrics import ssim_of_each
from learn.data.splits import Split, SplitKind
from scenes.files.plain_text import say
from simulate.dataset.dataset import Dataset
from simulate.spectra.spectrum import evenly, spectrum_of

BANDS = ((0.0, 0.25), (0.25, 0.5), (0.5, 1.0), (1.0, 2.0), (2.0, np.inf))
"""Bands of the distance to the nearest known position, wavelengths."""

INDEPENDENT = 0.5  # From this distance on, in wavelengths, the spectra of two positions have little in common


@dataclass(frozen=True)
class SplitDistances:
    """Distances from K test positions to the nearest known position each.

    Attributes:
        distance: [K] metres.
        wavelength: metres.
        known: number of known positions, those of the training and the validation part.

    Example:
        >>> found = SplitDistances(np.array([0.1, 0.2, 0.3]), wavelength=0.5, known=9)
        >>> found.near, found.facts()["test_to_known_median_wavelengths"]
        (2, 0.4)
    """

    distance: Float[np.ndarray, " K"]
    wavelength: float
    known: int

    @classmethod
    def between(
        cls, known: Float[np.ndarray, "n 3"], tested: Float[np.ndarray, "K 3"], wavelength: float
    ) -> SplitDistances:
        """Measure the distances from test positions to known ones, all in metres."""
        return cls(cKDTree(known).query(tested)[0], wavelength, len(known))

    @property
    def near(self) -> int:
        """Number of test positions that are nearer than half a wavelength to a known one."""
        return int((self.distance < INDEPENDENT * self.wavelength).sum())

    def facts(self) -> dict[str, Any]:
        """The distances as numbers, for JSON."""
        least, median = self.distance.min(), float(np.median(self.distance))
        return {
            "test_to_known_least_m": round(float(least), 4),
            "test_to_known_median_m": round(median, 4),
            "test_to_known_least_wavelengths": round(float(least) / self.wavelength, 3),
            "test_to_known_median_wavelengths": round(median / self.wavelength, 3),
            "test_nearer_than_half_a_wavelength": self.near,
        }

    def sentence(self) -> str:
        """The distances in words."""
        least, median = float(self.distance.min()), float(np.median(self.distance))
        return (
            f"from each of {len(self.distance)} test positions to the nearest of {self.known} known ones: at least "
            f"{least:.2g} m ({least / self.wavelength:.2g} wavelengths), median {median:.2g} m "
            f"({median / self.wavelength:.2g} wavelengths)"
        )

    def warning(self) -> str | None:
        """What follows if test positions are near to known ones. None: all are half a wavelength away or more."""
        if not self.near:
            return None
        return (
            f"{self.near} of {len(self.distance)} test positions are nearer than half a wavelength to a known one, so "
            "copying predicts part of what was measured there; --guard 0.5 leaves such known positions out, and "
            "--split area tests whole areas"
        )


def say_distances(distances: SplitDistances, before: str = "") -> None:
    """Say how far the test positions are from the known ones, and warn if some are near."""
    say(before + distances.sentence())
    warning = distances.warning()
    if warning is not None:
        say(f"warning: {warning}")


def distance_bands(wavelengths: Float[np.ndarray, " K"]) -> Iterator[tuple[str, Bool[np.ndarray, " K"]]]:
    """The bands of distances in words, with the positions in each."""
    for low, high in BANDS:
        words = f"{low:g} to {high:g} λ" if np.isfinite(high) else f"over {low:g} λ"
        yield words, (wavelengths >= low) & (wavelengths < high)


LEAKING_SSIM = 0.9
"""A split leaks if the median SSIM of test spectra and their nearest training spectra is at least this high."""

COMPARED, AT_ONCE = 2000, 100
"""Largest number of compared test spectra, evenly spread over the test part, and number of them in memory at once."""


@dataclass(frozen=True)
class Leakage:
    """K test spectra compared with the spectra at their nearest known positions.

    Known positions are those of the training and the validation part. A folder's own split has no validation part.
    """

    distance: Float[np.ndarray, " K"]  # [K] distance from each test position to the nearest known position, metres
    # [K] SSIM of each test spectrum and the spectrum at the nearest known position, at most 1
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
        """Distances and similarity, with what follows if the split leaks."""
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
