"""The table of scores that ``compare`` returns."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from learn.comparison.averages import average_name, averaged, doubts_of, remark_on, spread_of
from learn.comparison.results_folder import Settings
from learn.data.split_distances import SplitDistances
from learn.quantities.array_ceiling import CEILING, shown_name
from learn.quantities.quantity import Quantity

COSTS = {"steps": "steps", "seconds": "fit (s)", "milliseconds": "ms each"}
"""Headings of what a row cost, by its keys."""


@dataclass(frozen=True, kw_only=True, repr=False)
class Comparison:
    """Rows measured by ``compare``.

    ``pandas.DataFrame(comparison)`` makes a table of the rows. ``print(comparison)`` shows the averages over the seeds,
    the best first, and a notebook shows the same as HTML. ``len(comparison)`` and iteration are those of ``rows``.

    Each row is a dictionary with these entries:

    - "label", the method, "seed" of the fit, and "train_size", the number of training rows asked for (None: all);
    - "known" and "test", the numbers of known and of test rows, and "train", how many of the known ones are not set
      aside for validation;
    - the scores, which depend on the quantity. Of spectra "ssim_median", "ssim_mean", "ssim_p05" (5th percentile),
      "psnr_mean" (dB), "mae_mean" and "aoa_error_median_deg". Of received powers "error_median_db", "rmse_db",
      "error_p90_db", "received_rightly", "coverage_90", "interval_median_db", "powers" and "not_received". Of channels
      and responses over a band "snr_median_db", "snr_mean_db", "snr_p10_db", "correlation_median",
      "delay_spread_error_median_ns", "coverage_90" and "rows". Of rooms also "rooms", the median SSIM in each;
    - "seconds" of the fit, "milliseconds" of a prediction, "steps" of training and "parameters" (None: the method has
      none), "found", what the fit found in words, and "date";
    - "test_to_known_least_m", "test_to_known_median_m", the same in wavelengths, and
      "test_nearer_than_half_a_wavelength", where positions are known;
    - of a class of your own and of predictions "source", a hash that tells when they have to be measured again.

    Attributes:
        quantity: what is predicted, and how it is scored.
        settings: what all rows have in common.
        folder: folder of the results, with results.jsonl, per_sample/ and runs/; None: nothing was kept.
        rows: a dictionary for each method, seed and size, in the order in which they were measured.
        each: what was kept of each test row, of the first seed, as arrays by name, by the name of the row in the table:
            "ssim" and others of spectra; "error_db", "value", "low" and "high" of powers [test, gateways]; "snr_db" of
            channels and responses, and "examples" of channels.
        dataset: the dataset, or the rooms.
        parts: training, validation and test part, of several sizes those of the largest; None for rooms.
        test: the test rows that are scored, indices; None for rooms.
        distances: how far the test positions are from the known ones; None: positions or frequency are not known.

    Example:
        >>> import bisplat
        >>> comparison = bisplat.compare("data/lab", ["nearest"], tested=4)
        >>> [row["label"] for row in comparison.table()]  # the best first, the bound last; baselines are always in
        ['nearest', 'inverse-distance', 'mean-picture', "array's ceiling"]
        >>> comparison  # print(comparison) shows the table
        Comparison('lab': 3 methods for spectra, 32 known and 4 test spectra, split files)
    """

    quantity: Quantity
    settings: Settings
    folder: Path | None
    rows: list[dict[str, Any]]
    each: Mapping[str, Mapping[str, np.ndarray]] = field(default_factory=dict)
    dataset: Any = None
    parts: Any = None
    test: Any = None
    distances: SplitDistances | None = None

    def __len__(self) -> int:
        return len(self.rows)

    def __iter__(self) -> Iterator[dict[str, Any]]:
        return iter(self.rows)

    def __repr__(self) -> str:
        methods = len({row["label"] for row in self.rows} - {CEILING})
        known = max((row.get("known") or 0 for row in self.rows), default=0)
        test, things = max((row["test"] for row in self.rows), default=0), self.quantity.things
        name, what = Path(self.settings.dataset).name, f"{methods} methods for {self.quantity.in_words}"
        counts = f"{known} known and {test} test {things}"
        return f"Comparison({name!r}: {what}, {counts}, split {self.settings.split})"

    def averages(self) -> list[dict[str, Any]]:
        """Average the rows over the seeds.

        Returns:
            A flat dictionary for each method and size, in the order in which they were measured, with the entries of
            ``rows`` that are numbers, "seeds" (their number) and, of several, the standard deviation of the score that
            ranks, such as "ssim_spread".

        Example:
            >>> import bisplat
            >>> comparison = bisplat.compare("data/lab", ["nearest"], seeds=2, tested=4)
            >>> {row["label"]: row["seeds"] for row in comparison.averages()}["nearest"]
            2
        """
        return averaged(self.rows, ("label", "train_size"), self.quantity.ranked_by)

    def table(self) -> list[dict[str, Any]]:
        """Sort the averages: of several sizes the smallest first, then the best method; a bound is last."""
        return sorted(
            self.averages(),
            key=lambda row: [row["label"] == CEILING, row["train_size"] or 0, *self.quantity.rank(row)],
        )

    def doubts(self) -> dict[str, str]:
        """Say of which rows of the table the scores are doubtful, and why.

        Returns:
            What is doubtful, by the name of the row: it took fewer than 100 training steps, or it is worse than the
            mean of what is known. Rows without doubts are left out.
        """
        return doubts_of(self.averages(), self.quantity)

    def remark(self) -> str | None:
        """What a reader of the table has to know: methods with doubts, and what is not in the scores. None: nothing."""
        sentences = (remark_on(self.averages(), self.quantity, self.settings.minutes), self.quantity.remark(self.rows))
        return ". ".join(filter(None, sentences)) or None

    @property
    def columns(self) -> dict[str, str]:
        """Headings of the table, by the keys of a row."""
        return {**self.quantity.columns, **COSTS}

    @property
    def rooms(self) -> dict[str, Any]:
        """What differs from room to room, and the names of the training and the test rooms; empty for one dataset."""
        count = self.settings.test_rooms
        if count is None or self.dataset is None:
            return {}
        names = list(self.dataset.names)
        return {"setting": self.dataset.setting, "training_rooms": names[:-count], "test_rooms": names[-count:]}

    def facts(self) -> dict[str, Any]:
        """All scores and what they are of, for JSON; methods by name, of several sizes with the size."""
        table = self.table()
        facts: dict[str, Any] = {
            "dataset": self.settings.dataset,
            "quantity": self.settings.quantity,
            "split": self.settings.split,
            "seed": self.settings.seed,
            "guard": self.settings.guard,
            **self.rooms,
            "known": max((row.get("known") or 0 for row in self.rows), default=0),
            "test": max((row["test"] for row in self.rows), default=0),
            **({} if self.distances is None else self.distances.facts()),
            "methods": by_name(table),
        }
        return {**facts, "fits": self.rows} if any(row["seed"] for row in self.rows) else facts

    def cells(self) -> list[list[str]]:
        """The texts of the cells, headings first. Columns without any value are left out."""
        return cells_of(self.table(), self.columns, self.quantity.ranked_by)

    def __str__(self) -> str:
        lines = self.cells()
        widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
        text = ["  ".join(map(str.ljust, line, widths)).rstrip() for line in lines]
        remark = self.remark()
        return "\n".join(text if remark is None else [*text, remark])

    def _repr_html_(self) -> str:
        """The table as a notebook shows it."""
        head, *body = self.cells()
        rows = ["".join(f"<th>{cell}</th>" for cell in head)]
        rows += ["".join(f"<td>{escape(cell)}</td>" for cell in line) for line in body]
        return "<table>" + "".join(f"<tr>{row}</tr>" for row in rows) + "</table>"


def cells_of(rows: Sequence[Mapping[str, Any]], columns: Mapping[str, str], ranked_by: str) -> list[list[str]]:
    """The texts of a table's cells, headings first. Columns without any value are left out."""
    with_spread: dict[str, str] = {}
    for key, heading in columns.items():
        with_spread[key] = heading
        if key == ranked_by:
            with_spread[spread_of(key)] = "± seeds"
    keys = [key for key in with_spread if any(row.get(key) is not None for row in rows)]
    lines = [["", *(with_spread[key] for key in keys)]]
    for row in rows:
        numbers = ("" if row.get(key) is None else f"{row[key]:.4g}" for key in keys)
        lines.append([shown_name(average_name(row)), *numbers])
    return lines


def by_name(rows: Sequence[Mapping[str, Any]]) -> dict[str, dict[str, Any]]:
    """Rows by ``average_name``, without the keys that say what they are of."""
    left_out = ("label", "train_size")
    return {average_name(row): {key: value for key, value in row.items() if key not in left_out} for row in rows}
