"""Tables on stdout."""

from __future__ import annotations

from rich.console import Console
from rich.table import Table


def print_table(title: str, columns: dict[str, dict]) -> None:
    """Print a table.

    Args:
        title: of the table.
        columns: the cells of each column by the name of their row; the first column has all rows.
    """
    table = Table(title=title)
    table.add_column("")
    for name in columns:
        table.add_column(name.replace("_", " "))
    for row in next(iter(columns.values())):
        values = (column.get(row, "") for column in columns.values())
        table.add_row(row, *(f"{value:.4g}" if isinstance(value, float) else str(value) for value in values))
    Console().print(table)


def print_rows(title: str, rows: list[dict]) -> None:
    """Print a table.

    Args:
        title: of the table.
        rows: the cells of each row by the name of their column; all rows have the same columns.
    """
    table = Table(title=title)
    for name in rows[0]:
        table.add_column(name)
    for row in rows:
        table.add_row(*(f"{value:.4g}" if isinstance(value, float) else str(value) for value in row.values()))
    Console().print(table)
