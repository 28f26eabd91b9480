"""Tables of scores for papers: as LaTeX with booktabs, and as CSV with all digits."""

from __future__ import annotations

import csv
from collections.abc import Collection, Iterable, Mapping, Sequence
from io import StringIO
from pathlib import Path
from typing import Any

from learn.comparison.averages import average_name, spread_of
from learn.quantities.array_ceiling import CEILING, shown_name
from learn.reports.method_styles import DOUBTFUL
from learn.reports.provenance import Provenance
from scenes.files.atomic import write_atomically
from scenes.files.errors import printable

LATEX, CSV = "table.tex", "table.csv"  # Names of the files

_SPECIAL = {
    "\\": r"\textbackslash{}",
    **{sign: f"\\{sign}" for sign in "&%$#_{}"},
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "<": r"\textless{}",
    ">": r"\textgreater{}",
    "†": r"\textdagger{}",
    "°": r"\textdegree{}",
    "±": r"$\pm$",
    "×": r"$\times$",
}


def in_latex(text: str) -> str:
    r"""Escape text for LaTeX."""
    return "".join(_SPECIAL.get(sign, sign) for sign in printable(text))


def shown_number(value: float, key: str) -> str:
    """A number of a table, with as many digits as say something."""
    if key in ("parameters", "steps") or (key in ("seconds", "milliseconds") and value >= 100):
        return f"{value:,.0f}"
    return f"{value:.3g}" if key in ("seconds", "milliseconds") else f"{value:.3f}"


def write_tables(
    rows: Mapping[str, Mapping[str, Any]],
    columns: Mapping[str, str],
    folder: Path,
    provenance: Provenance,
    note: str = "",
) -> None:
    """Write table.tex, a ``tabular`` that needs booktabs and says where it comes from, and table.csv."""
    present = {key: title for key, title in columns.items() if any(row.get(key) is not None for row in rows.values())}
    write_atomically(folder / LATEX, _latex(rows, present, provenance, note).encode())
    write_atomically(folder / CSV, _csv(rows, present).encode())


def marked_rows(rows: Iterable[Mapping[str, Any]], doubts: Collection[str]) -> dict[str, Mapping[str, Any]]:
    """Rows by their names, which are marked if there are doubts."""
    return {f"{name}{DOUBTFUL if name in doubts else ''}": row for row in rows for name in [average_name(row)]}


def as_csv(lines: Iterable[Sequence[Any]]) -> str:
    """Lines of cells as CSV, headings first."""
    text = StringIO()
    csv.writer(text, lineterminator="\n").writerows(lines)
    return text.getvalue()


def _latex(rows: Mapping[str, Mapping[str, Any]], columns: Mapping[str, str], provenance: Provenance, note: str) -> str:
    comments = [provenance.title, provenance.sentence(), *([note] if note else [])]
    head = " & ".join(["Method", *map(in_latex, columns.values())])
    lines = [rf"\begin{{tabular}}{{l{'r' * len(columns)}}}", r"\toprule", rf"{head} \\", r"\midrule"]
    for name, row in rows.items():
        if name == CEILING:
            lines.append(r"\midrule")
        lines.append(" & ".join([in_latex(shown_name(name)), *(_cell(row, key) for key in columns)]) + r" \\")
    lines += [r"\bottomrule", r"\end{tabular}"]
    return "\n".join([*(f"% {printable(comment)}" for comment in comments), *lines]) + "\n"


def _cell(row: Mapping[str, Any], key: str) -> str:
    value = row.get(key)
    if value is None:
        return "--"
    text = shown_number(value, key)
    spread = row.get(spread_of(key))
    return text if spread is None else rf"{text} $\pm$ {spread:.3f}"


def _csv(rows: Mapping[str, Mapping[str, Any]], columns: Mapping[str, str]) -> str:
    keys = []
    for key in columns:
        keys.append(key)
        if any(row.get(spread_of(key)) is not None for row in rows.values()):
            keys.append(spread_of(key))
    cells = ([name, *("" if row.get(key) is None else row[key] for key in keys)] for name, row in rows.items())
    return as_csv([["method", *keys], *cells])
