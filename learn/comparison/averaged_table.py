"""Rows averaged over the seeds, what is doubtful about them, and the table that shows them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from html import escape
from typing import Any, ClassVar

import numpy as np

FEW_STEPS = 100  # With fewer training steps than this, a model has hardly begun to learn

MEAN_PICTURE = "mean_picture_ssim_median"
"""Key of a row: the median SSIM of the mean of the known spectra, on the same test spectra."""

BELOW = 1e-4  # A median SSIM counts as below another one if it is lower by more than this


def average_name(row: Mapping[str, Any]) -> str:
    """The name of a row of ``averages``: its label, and its number of training spectra if it states one."""
    return row["label"] if row["train_size"] is None else f"{row['label']}, {row['train_size']}"


def took_few_steps(row: Mapping[str, Any]) -> bool:
    """Whether a row was trained for fewer than ``FEW_STEPS`` steps."""
    return row.get("steps") is not None and row["steps"] < FEW_STEPS


def is_below_mean_picture(row: Mapping[str, Any]) -> bool:
    """Whether a row scores lower than the mean of the known spectra. Rows without the latter do not tell."""
    return row.get(MEAN_PICTURE) is not None and row["ssim_median"] < row[MEAN_PICTURE] - BELOW


def doubts_of(averages: Sequence[Mapping[str, Any]]) -> dict[str, str]:
    """What is doubtful about each row that has doubts, by ``average_name``."""
    found = {}
    for row in averages:
        each = [f"only {row['steps']:g} training steps"] if took_few_steps(row) else []
        if is_below_mean_picture(row):
            each.append(f"below the mean picture ({row[MEAN_PICTURE]:.3f})")
        if each:
            found[average_name(row)] = "; ".join(each)
    return found


def footnote_of(averages: Sequence[Mapping[str, Any]]) -> str:
    """What the mark of rows with doubts means. Empty: there are no such rows."""
    found = [f"fewer than {FEW_STEPS} training steps"] if any(map(took_few_steps, averages)) else []
    if any(map(is_below_mean_picture, averages)):
        found.append("below the mean picture")
    return f"† {', or '.join(found)}: says little" if found else ""


def remark_on(averages: Sequence[Mapping[str, Any]], minutes: float | None) -> str | None:
    """Name all rows with doubts, for a reader of the table."""
    few = [f"{average_name(row)} ({row['steps']:g})" for row in averages if took_few_steps(row)]
    below = [
        f"{average_name(row)} ({row['ssim_median']:.3f} against {row[MEAN_PICTURE]:.3f})"
        for row in averages
        if is_below_mean_picture(row)
    ]
    sentences = []
    if few and minutes is not None:
        sentences.append(
            f"only a few training steps fit into {minutes:g} minutes: {', '.join(few)}; such a score says little, so "
            "give a larger budget, in another folder"
        )
    elif few:
        sentences.append(
            f"only a few training steps were asked for: {', '.join(few)}; such a score says little, so give more "
            "steps, in another folder"
        )
    if below:
        sentences.append(
            f"below the mean of the known spectra, which is the same everywhere: {', '.join(below)}; differences "
            "between such rows say nothing about the methods"
        )
    if not sentences:
        return None
    first, *others = sentences
    return ". ".join([first, *(f"{each[0].upper()}{each[1:]}" for each in others)])


def spread_of(key: str) -> str:
    """Key of the standard deviation of a score over the seeds."""
    return key.replace("median", "spread") if "median" in key else f"{key}_spread"


def averaged(rows: Sequence[Mapping[str, Any]], names: Sequence[str], ranked_by: str) -> list[dict[str, Any]]:
    """Average rows that differ in their seed."""
    groups: dict[tuple[Any, ...], list[Mapping[str, Any]]] = {}
    for row in rows:
        groups.setdefault(tuple(row[name] for name in names), []).append(row)
    found = []
    for group in groups.values():
        columns = {key: [row.get(key) for row in group] for key in group[0] if key not in (*names, "seed")}
        means = {key: _mean(values) for key, values in columns.items() if all(map(_is_score, values))}
        row = {name: group[0][name] for name in names} | means | {"seeds": len(group)}
        if len(group) > 1 and row[ranked_by] is not None:
            row[spread_of(ranked_by)] = round(float(np.std([each[ranked_by] for each in group], ddof=1)), 9)
        found.append(row)
    return found


def _is_score(value: Any) -> bool:
    return value is None or (isinstance(value, int | float) and not isinstance(value, bool))


def _mean(values: list[Any]) -> float | None:
    """The mean, None where one is None. What all rows have in common stays as it is, so that counts stay whole."""
    if all(each == values[0] for each in values):
        return values[0]
    return None if None in values else float(np.mean(values))


class AveragedTable:
    """Base of the tables of fits that take seconds."""

    COLUMNS: ClassVar[Mapping[str, str]]
    """Headings of a printed table, by the keys of a row. Set by the subclass."""

    RANKED_BY: ClassVar[str]
    """Key of the score whose spread over the seeds is told. Set by the subclass."""

    rows: list[dict[str, Any]]
    minutes: float

    def __len__(self) -> int:
        return len(self.rows)

    def __iter__(self) -> Iterator[dict[str, Any]]:
        return iter(self.rows)

    def averages(self) -> list[dict[str, Any]]:
        """Average the rows over the seeds."""
        return averaged(self.rows, ("label", "train_size"), self.RANKED_BY)

    def table(self) -> list[dict[str, Any]]:
        """The averages, sorted."""
        raise NotImplementedError

    def facts(self) -> dict[str, Any]:
        """What results.json holds, apart from where the scores come from."""
        raise NotImplementedError

    def remark(self) -> str | None:
        """A sentence that names the methods that had too few training steps. None: there are none."""
        return remark_on(self.averages(), self.minutes)

    def cells(self) -> list[list[str]]:
        """The texts of the cells, headings first, then the best row. Columns without any value are left out."""
        rows = self.table()
        columns: dict[str, str] = {}
        for key, heading in self.COLUMNS.items():
            columns[key] = heading
            if key == self.RANKED_BY:
                columns[spread_of(key)] = "± seeds"
        keys = [key for key in columns if any(row.get(key) is not None for row in rows)]
        lines = [["", *(columns[key] for key in keys)]]
        for row in rows:
            lines.append([average_name(row), *("" if row.get(key) is None else f"{row[key]:.3g}" for key in keys)])
        return lines

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
