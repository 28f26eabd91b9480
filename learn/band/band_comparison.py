"""The table of scores that ``compare_band`` returns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float

from learn.comparison.score_table import ScoreTable
from learn.data.split_distances import SplitDistances
from learn.data.splits import SplitKind


@dataclass(frozen=True, kw_only=True)
class BandComparison(ScoreTable):
    """Rows measured by ``compare_band``.

    ``pandas.DataFrame(comparison)`` makes a table of the rows. ``print(comparison)`` shows them, the best first, and a
    notebook shows the same as HTML. ``len(comparison)`` and iteration are those of ``rows``.

    A row has "label", the name of the method, "seconds" for its fit and its predictions, "found", what its fit found in
    words (None: it says nothing), and these scores:

    - "snr_median_db", "snr_mean_db" and "snr_p10_db" (10th percentile) of the signal-to-noise ratio of the predicted
      responses over all elements and subcarriers of a position, 10 log₁₀ ‖y‖² / ‖y − ŷ‖², dB;
    - "correlation_median", of ``|ŷ^H y|`` / (‖ŷ‖ ‖y‖), which a wrong level or common phase leaves as it is;
    - "delay_spread_error_median_ns", of the absolute error of the root mean square delay spread, ns;
    - "coverage_90", the share of the real and imaginary parts of the responses within the stated 90 % intervals; None
      if the method states none.

    Attributes:
        folder: the dataset's folder.
        split: how the test part was chosen.
        seed: seed of the split and of the methods.
        guard: known positions nearer than this to a test position were left out, wavelengths.
        known_positions: number of known positions.
        test_positions: number of test positions.
        rows: a dictionary for each method, in the order in which they were measured.
        snr_db: SNR of each test position, dB, by method.
        distances: how far the test positions are from the known ones.
    """

    COLUMNS: ClassVar[Mapping[str, str]] = {
        "snr_median_db": "median SNR (dB)",
        "snr_mean_db": "mean SNR (dB)",
        "snr_p10_db": "10th % (dB)",
        "correlation_median": "median correlation",
        "delay_spread_error_median_ns": "delay spread off (ns)",
        "coverage_90": "in 90 % interval",
        "seconds": "seconds",
    }

    folder: Path
    split: SplitKind
    seed: int
    guard: float
    known_positions: int
    test_positions: int
    rows: list[dict[str, Any]]
    snr_db: Mapping[str, Float[np.ndarray, " K"]]
    distances: SplitDistances

    def __repr__(self) -> str:
        return (
            f"BandComparison({str(self.folder)!r}: {len(self)} methods, {self.known_positions} known and "
            f"{self.test_positions} test positions, split {self.split})"
        )

    def table(self) -> list[dict[str, Any]]:
        """Sort the rows by the median SNR, the largest first; of equal ones, by the mean."""
        return sorted(self.rows, key=lambda row: [-(row[key] or 0.0) for key in ("snr_median_db", "snr_mean_db")])

    def facts(self) -> dict[str, Any]:
        """All scores and what they are of, for JSON."""
        return {
            "dataset": str(self.folder),
            "split": self.split,
            "seed": self.seed,
            "guard": self.guard,
            "known": self.known_positions,
            "test": self.test_positions,
            **self.distances.facts(),
            "methods": {row["label"]: {key: row[key] for key in row if key != "label"} for row in self.table()},
        }
