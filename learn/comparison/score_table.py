"""The scores of methods that predict powers or channels: a row for each fit, printed, shown in a notebook, as JSON."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

import numpy as np
from jaxtyping import Float

from learn.comparison.averages import averaged, spread_of
from learn.comparison.doubts import average_name, remark_on
from learn.data.split_distances import SplitDistances
from learn.data.splits import Split, SplitKind


class Measure(NamedTuple):
    """The score by which methods are ranked.

    Attributes:
        name: its name in those of figures.
        key: its key in a row.
        second: key of the score that ranks methods with equal ones.
        small_is_good: whether the best method has the smallest.
        of_each: what it is the median of, with the unit, for the axis of a figure.
        share: what the shares of a distribution are of.
    """

    name: str
    key: str
    second: str
    small_is_good: bool
    of_each: str
    share: str


@dataclass(frozen=True, kw_only=True)
class ScoreTable:
    """Base of the comparisons of powers and of channels.

    Attributes:
        folder: the dataset's folder.
        split: how the test part was chosen.
        seed: seed of the split.
        guard: known positions nearer than this to a test position were left out, wavelengths.
        minutes: training time of each method that is trained by steps.
        parts: training, validation and test part; of several sizes, those of the largest.
        rows: a dictionary for each method, seed and size, in the order in which they were measured.
        distances: how far the test positions are from the known ones. None: positions or frequency are not known.
    """

    COLUMNS: ClassVar[Mapping[str, str]]
    """Headings of a printed table, by the keys of a row. Set by the subclass, as the next."""

    MEASURE: ClassVar[Measure]

    THINGS: ClassVar[str]
    """What is known and tested: positions or rows."""

    folder: Path
    split: SplitKind
    seed: int
    guard: float
    minutes: float
    parts: Split = field(repr=False)
    rows: list[dict[str, Any]]
    distances: SplitDistances | None

    @property
    def known(self) -> int:
        """Number of known positions or rows, those of the training and the validation part; the largest of several."""
        return len(self.parts.known)

    @property
    def test(self) -> int:
        """Number of test positions or rows."""
        return len(self.parts.test)

    def __len__(self) -> int:
        return len(self.rows)

    def __iter__(self) -> Iterator[dict[str, Any]]:
        return iter(self.rows)

    def of_each(self) -> dict[str, Float[np.ndarray, "..."]]:
        """The single scores of which ``MEASURE`` is the median, by the name of the row in the table; first seed."""
        raise NotImplementedError

    def averages(self) -> list[dict[str, Any]]:
        """Average the rows over the seeds.

        Returns:
            A dictionary for each method and size, in the order in which they were measured, with "seeds", their number,
            and, of several, the standard deviation of the score that ranks the methods, as "error_spread_db" of powers
            and "snr_spread_db" of channels.
        """
        return averaged(self.rows, ("label", "train_size"), self.MEASURE.key)

    def table(self) -> list[dict[str, Any]]:
        """The averages, the best first; of several sizes, the smallest first."""
        sign = 1 if self.MEASURE.small_is_good else -1

        def rank(row: dict[str, Any]) -> list[float]:
            keys = (self.MEASURE.key, self.MEASURE.second)
            scores = [np.inf if row[key] is None else sign * row[key] for key in keys]
            return [row["train_size"] or 0, *scores]

        return sorted(self.averages(), key=rank)

    def remark(self) -> str | None:
        """A sentence that names the methods that had too few training steps. None: there are none."""
        return remark_on(self.averages(), self.minutes)

    def facts(self) -> dict[str, Any]:
        """All scores and what they are of, for JSON; methods by name, of several sizes with the size."""
        facts: dict[str, Any] = {
            "dataset": str(self.folder),
            "split": self.split,
            "seed": self.seed,
            "guard": self.guard,
            "known": self.known,
            "test": self.test,
            **({} if self.distances is None else self.distances.facts()),
            "methods": by_name(self.table()),
        }
        if any(row["seed"] for row in self.rows):
            facts["fits"] = self.rows
        return facts

    def cells(self) -> list[list[str]]:
        """The texts of the cells, headings first, then the best row. Columns without any value are left out."""
        rows = self.table()
        spread = spread_of(self.MEASURE.key)
        columns = {}
        for key, heading in self.COLUMNS.items():
            columns[key] = heading
            if key == self.MEASURE.key:
                columns[spread] = "± seeds"
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


def by_name(rows: Sequence[Mapping[str, Any]], *others: str) -> dict[str, dict[str, Any]]:
    """Rows by ``average_name``, without the keys that say what they are of.

    Args:
        rows: averages.
        others: further such keys.
    """
    left_out = ("label", "train_size", *others)
    return {average_name(row): {key: value for key, value in row.items() if key not in left_out} for row in rows}
