"""Tables on stdout. They are folded to the width of a terminal, or as wide as needed in a file or pipe; never cut."""

from __future__ import annotations

import sys

from rich.table import Table

from scenes.files.errors import printable
from scenes.files.plain_text import plain_console

WIDEST = 80
"""Most characters per line of a cell. Longer text is folded."""

UNLIMITED = 10_000
"""Characters per line: more than any table has."""


def print_table(title: str, columns: dict[str, dict]) -> None:
    """Print a table that is given by its columns."""
    table = Table(title=printable(title))
    table.add_column("", overflow="fold", max_width=WIDEST)
    for name in columns:
        heading = printable(name.replace("_", " "))
        if sys.stdout.isatty():  # a narrow terminal would break inverse-distance in the middle of a word
            heading = heading.replace("-", "-\n")
        table.add_column(heading, overflow="fold", max_width=WIDEST)
    for row in next(iter(columns.values())):
        values = (column.get(row, "") for column in columns.values())
        table.add_row(printable(row), *map(_cell, values))
    _print(table)


def print_rows(title: str, rows: list[dict]) -> None:
    """Print a table that is given by its rows."""
    table = Table(title=printable(title))
    for name in rows[0]:
        table.add_column(printable(name), overflow="fold", max_width=WIDEST)
    for row in rows:
        table.add_row(*map(_cell, row.values()))
    _print(table)


def _cell(value: object) -> str:
    if value is None:
        return "–"
    return f"{value:.4g}" if isinstance(value, float) else printable(str(value))


def _print(table: Table) -> None:
    # Without a terminal, rich would assume a width of 80.
    plain_console(width=None if sys.stdout.isatty() else UNLIMITED).print(table)
