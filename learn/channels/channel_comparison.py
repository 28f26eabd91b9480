"""The table of scores that ``compare_channels`` returns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float

from learn.comparison.score_table import ScoreTable, without
from learn.data.splits import SplitKind


@dataclass(frozen=True)
class ChannelComparison(ScoreTable):
    """Rows measured by ``compare_channels``.

    ``pandas.DataFrame(comparison)`` makes a table of the rows. ``print(comparison)`` shows them, the best first, and a
    notebook shows the same as HTML. ``len(comparison)`` and iteration are those of ``rows``.

    A row has "label", the name of the method, "seconds" for its fit and its predictions, and these scores:

    - "rows", the number of test rows that the scores refer to, those whose downlink is not zero;
    - "snr_median_db", "snr_mean_db" and "snr_p10_db" (10th percentile) of the signal-to-noise ratio of the predicted
      downlink, 10 log₁₀ ‖h‖² / ‖h − ĥ‖² for each row, dB, at most 200;
    - "correlation_median", of ``|ĥ^H h|`` / (‖ĥ‖ ‖h‖), which a wrong level or common phase leaves as it is.

    They are None if no test row has a downlink.

    Attributes:
        folder: the dataset's folder.
        split: how the test part was chosen.
        seed: seed of the split.
        known: number of known rows.
        test: number of test rows.
        rows: a dictionary for each method, in the order in which they were measured.
        snr_db: SNR of each test row, dB, [test], by method; NaN where the downlink is zero.

    Example:
        >>> import bisplat, numpy as np
        >>> array = bisplat.PlanarArray(1, 8)
        >>> ramps = np.exp(-1j * np.linspace(0.1, 0.3, 20)[:, None, None] * np.arange(52)) * np.ones((8, 1))
        >>> y = np.random.default_rng(0).uniform(1, 2, (20, 1, 1)) * ramps
        >>> wide = bisplat.write_dataset("data/ramps", np.eye(20, 3), y, array, "2.4 GHz", bandwidth="20 MHz")
        >>> bisplat.export_csi(wide, "ramps")
        >>> comparison = bisplat.compare_channels("ramps", ["copy", "ramp"], split="random")
        >>> [row["label"] for row in comparison.table()]  # the best first
        ['ramp', 'copy']
        >>> comparison.snr_db["copy"].shape
        (4,)
        >>> comparison
        ChannelComparison('ramps': 2 methods, 16 known and 4 test rows, split random)
    """

    COLUMNS: ClassVar[Mapping[str, str]] = {
        "snr_median_db": "median SNR (dB)",
        "snr_mean_db": "mean SNR (dB)",
        "snr_p10_db": "10th % (dB)",
        "correlation_median": "median correlation",
        "seconds": "seconds",
    }

    folder: Path
    split: SplitKind
    seed: int
    known: int
    test: int
    rows: list[dict[str, Any]]
    snr_db: Mapping[str, Float[np.ndarray, " K"]]

    def __repr__(self) -> str:
        return (
            f"ChannelComparison({str(self.folder)!r}: {len(self)} methods, {self.known} known and {self.test} test "
            f"rows, split {self.split})"
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
            "known": self.known,
            "test": self.test,
            "methods": {row["label"]: without(row, "label") for row in self.table()},
        }
