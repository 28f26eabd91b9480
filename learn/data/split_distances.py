"""How far the test positions of a split are from the known ones."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float
from scipy.spatial import cKDTree

from scenes.files.plain_text import say

BANDS = ((0.0, 0.25), (0.25, 0.5), (0.5, 1.0), (1.0, 2.0), (2.0, np.inf))
"""Bands of the distance to the nearest known position, wavelengths."""

INDEPENDENT = 0.5
"""From this distance on, in wavelengths, the spectra of two positions have little in common."""


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
    """The bands of distances in words, with the positions in each.

    >>> [words for words, within in distance_bands(np.array([0.3, 5.0])) if within.any()]
    ['0.25 to 0.5 λ', 'over 2 λ']
    """
    for low, high in BANDS:
        words = f"{low:g} to {high:g} λ" if np.isfinite(high) else f"over {low:g} λ"
        yield words, (wavelengths >= low) & (wavelengths < high)
