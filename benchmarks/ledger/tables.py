"""Tables in hand-written pages of docs/, filled in from the measured sections.

A table stands between a comment and <!-- end -->. The comment is one of

    <!-- table: SECTION -->                                       the whole table of a section
    <!-- table: SECTION | rows: A; B | columns: C; D -->          some of its rows and columns, by their headings
    <!-- across: COLUMN | sections: HEADING = SECTION; ... -->    one column of several sections side by side
    <!-- sizes: COLUMN | section: SECTION -->                     one column of a sweep, by number of spectra

``across`` and ``sizes`` take ``rows``, too. Links to the sections in measurements.md follow each table.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from benchmarks.ledger.entry import Entry, Measured
from scenes.files.errors import InputError, did_you_mean

TRAINED_ON = "training spectra"
"""Heading of the column of a sweep that has the number of training spectra."""

MISSING = "–"


def with_tables(text: str, entries: dict[str, Entry], generated: str = "generated") -> str:
    """A page with its tables as the sections have them now."""

    def filled(found: re.Match[str]) -> str:
        kind, argument, *rest = (part.strip() for part in re.split(r":\s|\s\|\s", found[1]))
        given = dict(zip(rest[::2], rest[1::2], strict=True))
        rows = _listed(given.get("rows"))
        if kind == "table":
            table = _chosen(_measured(entries, argument), rows, _listed(given.get("columns")))
            sections = [argument]
        elif kind == "sizes":
            sections = [given["section"]]
            table = _by_size(_measured(entries, given["section"]), argument, rows)
        else:
            named = dict(re.split(r"\s*=\s*", each) for each in _listed(given["sections"]))
            sections = list(named.values())
            table = _across({head: _measured(entries, name) for head, name in named.items()}, argument, rows)
        links = ", ".join(
            f"[{entries[name].title}]({generated}/measurements.md#{anchor(entries[name].title)})" for name in sections
        )
        return f"<!-- {found[1]} -->\n\n{markdown(table)}\n\nFrom {links}.\n\n<!-- end -->"

    return re.sub(r"<!-- ((?:table|across|sizes):.*?) -->.*?<!-- end -->", filled, text, flags=re.DOTALL)


def anchor(heading: str) -> str:
    """The anchor of a heading, as MyST and the forges make it."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def markdown(table: Sequence[Sequence[str]]) -> str:
    """A table, whose first line has the headings, in Markdown."""
    heading, *lines = table
    return "\n".join(
        "|" + "".join(f" {cell} |" if cell else " |" for cell in cells)
        for cells in (heading, ["---"] * len(heading), *lines)
    )


def _listed(text: str | None) -> list[str]:
    return [] if text is None else [each.strip() for each in text.split(";")]


def _measured(entries: dict[str, Entry], name: str) -> Measured:
    if name not in entries:
        raise InputError(
            f"docs: expected the name of a section of sections.toml, found {name}; {did_you_mean(name, entries)}"
        )
    return entries[name].measured


def _index(headings: Sequence[str], wanted: str) -> int:
    if wanted not in headings:
        raise InputError(
            f"docs: expected the heading of a row or column, found {wanted}; {did_you_mean(wanted, headings)}"
        )
    return headings.index(wanted)


def _chosen(measured: Measured, rows: Sequence[str], columns: Sequence[str]) -> list[list[str]]:
    """Some rows and columns of a table, or all, with the first column."""
    labels = [row[0] for row in measured.rows]
    lines = [measured.rows[_index(labels, row)] for row in rows] if rows else measured.rows
    kept = [0, *(_index(measured.columns, column) for column in columns)] if columns else range(len(measured.columns))
    return [[line[i] for i in kept] for line in [measured.columns, *lines]]


def _across(tables: dict[str, Measured], column: str, rows: Sequence[str]) -> list[list[str]]:
    """One column of several tables side by side, the best of the last table first unless rows are given."""
    values = {
        heading: {row[0]: row[_index(table.columns, column)] for row in table.rows} for heading, table in tables.items()
    }
    last = list(values.values())[-1]
    labels = list(rows) or sorted(
        dict.fromkeys(label for each in values.values() for label in each),
        key=lambda label: last.get(label, ""),
        reverse=True,
    )
    for label in rows:
        _index([each for value in values.values() for each in value], label)
    return [["", *tables], *([label, *(each.get(label, MISSING) for each in values.values())] for label in labels)]


def _by_size(measured: Measured, column: str, rows: Sequence[str]) -> list[list[str]]:
    """A sweep's column as a table with a row for each method and a column for each number of training spectra."""
    at, size = _index(measured.columns, column), _index(measured.columns, TRAINED_ON)
    values = {(row[0], row[size]): row[at] for row in measured.rows}
    sizes = sorted({size for _, size in values if size != MISSING}, key=int)
    labels = list(dict.fromkeys(label for label, _ in values))
    chosen = [labels[_index(labels, row)] for row in rows] if rows else labels
    chosen = chosen if rows else sorted(chosen, key=lambda label: values.get((label, sizes[-1]), ""), reverse=True)
    return [["", *sizes], *([label, *(values.get((label, each), MISSING) for each in sizes)] for label in chosen)]
