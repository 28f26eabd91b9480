"""Rows of scores, averaged over the seeds: printed, shown in a notebook, and as a sequence."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from html import escape
from typing import Any, ClassVar

from learn.comparison.averages import averaged, spread_of
from learn.comparison.doubts import average_name, remark_on


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
