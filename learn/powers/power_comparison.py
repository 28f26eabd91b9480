"""The table of scores that ``compare_powers`` returns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float

from learn.comparison.score_table import ScoreTable, without
from learn.data.split_distances import SplitDistances
from learn.data.splits import SplitKind


@dataclass(frozen=True)
class PowerComparison(ScoreTable):
    """Rows measured by ``compare_powers``.

    ``pandas.DataFrame(comparison)`` makes a table of the rows. ``print(comparison)`` shows them, the best first, and a
    notebook shows the same as HTML. ``len(comparison)`` and iteration are those of ``rows``.

    A row has "label", the name of the method, "seconds" for its fit and its predictions, and these scores:

    - "powers", the number of received powers at the test positions, and "not_received", that of those that were not;
    - "error_median_db", "error_p90_db" (90th percentile) and "rmse_db" of the absolute error of received powers, dB;
      None if none was received. A power that was not received has no error in dB;
    - "received_rightly": share of all powers of which it is predicted rightly whether they are received;
    - "coverage_90": share of the received powers within the stated 90 % intervals, and "interval_median_db", their
      median width; None if the method states none.

    Attributes:
        folder: the dataset's folder.
        split: how the test part was chosen.
        seed: seed of the split and of the methods.
        guard: known positions nearer than this to a test position were left out, wavelengths.
        known: number of known positions.
        test: number of test positions.
        rows: a dictionary for each method with all gateways together, in the order in which they were measured.
        gateway_rows: the same for each method and gateway; "gateway" is the gateway's name.
        errors: absolute error of each power in dB, [test, gateways], by method; NaN where nothing was received.
        distances: how far the test positions are from the known ones.

    Example:
        >>> import bisplat, numpy as np
        >>> places = np.random.default_rng(0).uniform(0, 4, (40, 3))
        >>> powers = -40 - 20 * np.log10(np.linalg.norm(places - [0, 0, 5], axis=1))[:, None]
        >>> hall = bisplat.write_rssi("law", places, powers, {"door": (0, 0, 5)}, "2.4 GHz")
        >>> comparison = bisplat.compare_powers(hall, ["mean", "log-distance"], split="random")
        >>> [row["label"] for row in comparison.table()]  # the best first
        ['log-distance', 'mean']
        >>> comparison.errors["mean"].shape
        (8, 1)
        >>> comparison
        PowerComparison('law': 2 methods, 1 gateway, 32 known and 8 test positions, split random)
    """

    COLUMNS: ClassVar[Mapping[str, str]] = {
        "error_median_db": "median error (dB)",
        "error_p90_db": "90th % (dB)",
        "rmse_db": "RMSE (dB)",
        "received_rightly": "received or not, right",
        "coverage_90": "in 90 % interval",
        "seconds": "seconds",
    }

    folder: Path
    split: SplitKind
    seed: int
    guard: float
    known: int
    test: int
    rows: list[dict[str, Any]]
    gateway_rows: list[dict[str, Any]]
    errors: Mapping[str, Float[np.ndarray, "K G"]]
    distances: SplitDistances

    def __repr__(self) -> str:
        count = len({row["gateway"] for row in self.gateway_rows})
        gateways = "1 gateway" if count == 1 else f"{count} gateways"
        return (
            f"PowerComparison({str(self.folder)!r}: {len(self)} methods, {gateways}, {self.known} known and "
            f"{self.test} test positions, split {self.split})"
        )

    def table(self) -> list[dict[str, Any]]:
        """Sort the rows by the median absolute error, the smallest first; of equal ones, by the root mean square."""
        return sorted(self.rows, key=lambda row: [np.inf if row[key] is None else row[key] for key in _ORDER])

    def facts(self) -> dict[str, Any]:
        """All scores and what they are of, for JSON."""
        table = self.table()
        return {
            "dataset": str(self.folder),
            "split": self.split,
            "seed": self.seed,
            "guard": self.guard,
            "known": self.known,
            "test": self.test,
            **self.distances.facts(),
            "methods": {row["label"]: without(row, "label") for row in table},
            "gateways": {
                row["label"]: {
                    each["gateway"]: without(each, "label", "gateway")
                    for each in self.gateway_rows
                    if each["label"] == row["label"]
                }
                for row in table
            },
        }


_ORDER = ("error_median_db", "rmse_db")
