"""The table that ``compare``, ``ablate`` and ``sweep`` return."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from learn.baselines.array_ceiling import CEILING, shown_name
from learn.comparison.experiment import Experiment, Settings, row_name, summary
from learn.comparison.scores_file import read_scores

HEADINGS = {
    "ssim_median": "SSIM",
    "ssim_spread": "± seeds",
    "ssim_p05": "5th %",
    "aoa_error_median_deg": "AoA (°)",
    "training_seconds": "train (s)",
    "milliseconds_per_spectrum": "ms each",
}
"""Headings of a printed table, by the keys of a row."""

FEW_STEPS = 100
"""A model that was trained for fewer steps within its budget has hardly begun to learn."""


@dataclass(frozen=True)
class Comparison:
    """Measured rows. ``pandas.DataFrame(comparison)`` makes a table of them.

    Attributes:
        folder: the experiment's folder, with results.jsonl, per_sample/ and runs/.
        settings: dataset, split, training time and device, which the rows have in common.
        rows: a flat dictionary for each method, seed and size, in the order they were measured: "label", "seed",
            "train_size" (None: all of the training part), "test" (number of test spectra), "ssim_median",
            "ssim_mean", "ssim_p05", "psnr_mean" (dB), "mae_mean", "aoa_error_median_deg", "date", and, except for the
            array's ceiling, "train" (number of training spectra), "parameters", "training_seconds" and
            "milliseconds_per_spectrum"; a model that was trained by steps also has "steps".

    >>> settings = Settings("data/lab", "files", 0, 5.0, None, "1 CPU threads")
    >>> row = {"seed": 0, "train_size": None, "test": 20}
    >>> rows = [{"label": "nearest", "ssim_median": 0.5, **row}, {"label": "mlp", "ssim_median": 0.75, **row}]
    >>> comparison = Comparison(Path("runs/table"), settings, rows)
    >>> len(comparison), [row["label"] for row in comparison], [row["label"] for row in comparison.table()]
    (2, ['nearest', 'mlp'], ['mlp', 'nearest'])
    >>> print(comparison)
             SSIM
    mlp      0.75
    nearest  0.5
    """

    folder: Path
    settings: Settings
    rows: list[dict[str, Any]]

    @classmethod
    def of(cls, experiment: Experiment) -> Comparison:
        """All rows that were measured in an experiment's folder, by this call and earlier ones."""
        return cls(experiment.folder, experiment.settings, experiment.rows)

    def __len__(self) -> int:
        return len(self.rows)

    def __iter__(self) -> Iterator[dict[str, Any]]:
        return iter(self.rows)

    def averages(self) -> list[dict[str, Any]]:
        """Averages over the seeds, a flat dictionary for each method and size, in the order they were measured.

        Each has the keys of ``rows`` with numbers, "seeds" (number of seeds) and "ssim_spread" (standard deviation of
        "ssim_median" over the seeds, 0 for a single seed).
        """
        groups = summary(self.rows, lambda row: (row["label"], row["train_size"]))
        return [{"label": label, **figures, "train_size": size} for (label, size), figures in groups.items()]

    def table(self) -> list[dict[str, Any]]:
        """``averages``, with the highest median SSIM first; the array's ceiling, which is no method, last."""
        return sorted(self.averages(), key=lambda row: (row["label"] == CEILING, -row["ssim_median"]))

    def per_sample(self, row: Mapping[str, Any]) -> dict[str, Float[np.ndarray, " K"]]:
        """Scores of the K test spectra of a row: "ssim", "psnr_db", "mae", "aoa_error_deg".

        Args:
            row: one of ``rows``.

        Raises:
            InputError: the row's file in ``folder`` is gone or damaged.
        """
        return read_scores(self.folder / "per_sample" / f"{row_name(row)}.csv")

    def remark(self) -> str | None:
        """A sentence about models whose budget was too short for more than a few steps; None: there are none.

        >>> settings = Settings("data/lab", "files", 0, 0.1, None, "1 CPU threads")
        >>> row = {"label": "mlp", "seed": 0, "train_size": None, "ssim_median": 0.5, "steps": 2}
        >>> Comparison(Path("runs/table"), settings, [row]).remark()
        'trained for few steps only, all that fit into 0.1 minutes: mlp (2); such a score says little, and a larger \
budget trains longer'
        """
        minutes = self.settings.minutes
        few = {average_name(row): row["steps"] for row in self.averages() if row.get("steps", FEW_STEPS) < FEW_STEPS}
        if minutes is None or not few:  # steps that were asked for need no remark
            return None
        named = ", ".join(f"{name} ({steps:g})" for name, steps in few.items())
        return (
            f"trained for few steps only, all that fit into {minutes:g} minutes: {named}; such a score says little, "
            "and a larger budget trains longer"
        )

    def __str__(self) -> str:
        lines = table_cells(self.table())
        widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
        text = ["  ".join(map(str.ljust, line, widths)).rstrip() for line in lines]
        remark = self.remark()
        return "\n".join(text if remark is None else [*text, remark])

    def _repr_html_(self) -> str:
        """The table as a notebook shows it."""
        head, *body = table_cells(self.table())
        rows = ["".join(f"<th>{cell}</th>" for cell in head)]
        rows += ["".join(f"<td>{escape(cell)}</td>" for cell in line) for line in body]
        return "<table>" + "".join(f"<tr>{row}</tr>" for row in rows) + "</table>"


def average_name(row: Mapping[str, Any]) -> str:
    """Name of one of the ``averages``: its label, and its number of training spectra if it has one.

    >>> average_name({"label": "mlp", "train_size": 200})
    'mlp, 200'
    """
    return row["label"] if row["train_size"] is None else f"{row['label']}, {row['train_size']}"


def table_cells(averages: Sequence[Mapping[str, Any]]) -> list[list[str]]:
    """Texts of the cells of a table, headings first, without the columns that no row has a value for.

    Args:
        averages: rows of ``Comparison.averages``. The spread over the seeds of a row with one seed is not shown.
    """

    def shown(row: Mapping[str, Any], key: str) -> bool:
        return key in row and (key != "ssim_spread" or row["seeds"] > 1)

    keys = [key for key in HEADINGS if any(shown(row, key) for row in averages)]
    lines = [["", *(HEADINGS[key] for key in keys)]]
    for row in averages:
        lines.append([shown_name(average_name(row)), *(f"{row[key]:.4g}" if shown(row, key) else "" for key in keys)])
    return lines
