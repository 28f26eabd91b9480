"""Tables of scores for papers: as LaTeX with booktabs, and as CSV with all digits."""

from __future__ import annotations

import csv
import json
from collections.abc import Collection, Iterable, Mapping, Sequence
from io import StringIO
from pathlib import Path
from typing import Any

from learn.baselines.array_ceiling import CEILING, shown_name
from learn.comparison.averaged_table import AveragedTable, average_name, doubts_of, footnote_of, spread_of
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
    if key in ("parameters", "training_seconds", "steps"):
        return f"{value:,.0f}"
    return (
        f"{value:,.0f}" if key == "seconds" and value >= 100 else f"{value:.3g}" if key == "seconds" else f"{value:.3f}"
    )


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


def write_scores(comparison: AveragedTable, folder: Path, provenance: Provenance) -> None:
    """Write results.json, with all scores and where they come from, and their table.tex and table.csv."""
    facts = {**comparison.facts(), "provenance": provenance.facts()}
    write_atomically(folder / "results.json", (json.dumps(facts, indent=2) + "\n").encode())
    averages = comparison.averages()
    rows = marked_rows(comparison.table(), doubts_of(averages))
    write_tables(rows, comparison.COLUMNS, folder, provenance, footnote_of(averages))


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
