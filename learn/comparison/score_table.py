"""Rows of scores, one for each method: printed, shown in a notebook, and chosen by name."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from html import escape
from typing import Any, ClassVar

from scenes.files.errors import ParameterError, require_instance, require_word, shown


class ScoreTable:
    """Base of the comparisons that score each method once: its rows as a sequence, as text and as HTML."""

    COLUMNS: ClassVar[Mapping[str, str]]
    """Headings of a printed table, by the keys of a row. Set by the subclass."""

    rows: list[dict[str, Any]]

    def __len__(self) -> int:
        return len(self.rows)

    def __iter__(self) -> Iterator[dict[str, Any]]:
        return iter(self.rows)

    def table(self) -> list[dict[str, Any]]:
        """The rows, the best first."""
        raise NotImplementedError

    def facts(self) -> dict[str, Any]:
        """All scores and what they are of, for JSON."""
        raise NotImplementedError

    def cells(self) -> list[list[str]]:
        """The texts of the cells, headings first, then the best row. Columns without any value are left out."""
        rows = self.table()
        keys = [key for key in self.COLUMNS if any(row[key] is not None for row in rows)]
        lines = [["", *(self.COLUMNS[key] for key in keys)]]
        for row in rows:
            lines.append([row["label"], *("" if row[key] is None else f"{row[key]:.3g}" for key in keys)])
        return lines

    def __str__(self) -> str:
        lines = self.cells()
        widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
        return "\n".join("  ".join(map(str.ljust, line, widths)).rstrip() for line in lines)

    def _repr_html_(self) -> str:
        """The table as a notebook shows it."""
        head, *body = self.cells()
        rows = ["".join(f"<th>{cell}</th>" for cell in head)]
        rows += ["".join(f"<td>{escape(cell)}</td>" for cell in line) for line in body]
        return "<table>" + "".join(f"<tr>{row}</tr>" for row in rows) + "</table>"


def without(row: Mapping[str, Any], *keys: str) -> dict[str, Any]:
    """A row without some of its keys."""
    return {key: value for key, value in row.items() if key not in keys}


def label_of(name: str, method: Any) -> str:
    """The name of a method in a table, which says if it is smaller than published because there is no GPU."""
    return f"{name} (reduced)" if getattr(method, "reduced", False) else name


def chosen_methods(given: Any, known: Mapping[str, Any]) -> list[str]:
    """The names of the methods that are given, each once. None: all but those that are trained by steps, for minutes.

    Args:
        given: what the caller gave as ``methods``.
        known: all methods by name.

    Raises:
        ParameterError: it is no list of names, or an empty one, or no method has one of them.
    """
    if given is None:
        return [name for name, method in known.items() if not getattr(method, "by_steps", False)]
    if isinstance(given, str) or not isinstance(given, Iterable):
        raise ParameterError("methods", f"expected a list of names, found {shown(given)}")
    names = list(given)
    if not names:
        raise ParameterError("methods", "expected at least one method, found none")
    for name in names:
        require_instance(str, methods=name)
        require_word(known, methods=name)
    return list(dict.fromkeys(names))
