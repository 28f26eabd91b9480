"""Show text from files, such as the name of a scene, literally: not as markup, formulas or terminal commands.

Tables on stdout are folded to the width of a terminal, or as wide as needed in a file or pipe; never cut.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from rich.console import Console
from rich.table import Table

from scenes.files.errors import SHOWN, cut, printable


def in_figure(text: str) -> str:
    r"""Format text for a figure of Matplotlib: without formulas, on one line, and cut if long."""
    plain = cut(text).replace("$", r"\$")
    return f" {plain}" if plain.startswith("_") else plain


def in_markdown(text: str) -> str:
    r"""Escape text for a panel of the viewer, which reads Markdown and HTML."""
    return re.sub(r"([!-/:-@\[-`{-~])", r"\\\1", printable(text))


LONGEST_WORD = 300  # Most characters of a word. A longer one, such as an impossible path, is cut.


_warned: ContextVar[set[str] | None] = ContextVar("warnings of the running command", default=None)


@contextmanager
def warning_once() -> Iterator[None]:
    """Let ``say`` print each warning once, however often the parts of a command find it."""
    token = _warned.set(set())
    try:
        yield
    finally:
        _warned.reset(token)


def say(sentence: str) -> None:
    """Print a sentence for the user on stderr, after the name of the program."""
    warned = _warned.get()
    if warned is not None and sentence.startswith("warning: "):
        if sentence in warned:
            return
        warned.add(sentence)
    short = re.sub(rf"\S{{{LONGEST_WORD},}}", lambda word: f"{word[0][:SHOWN]}…{word[0][-SHOWN:]}", sentence)
    print(f"bisplat: {printable(short)}", file=sys.stderr)


def plain_console(**options) -> Console:
    """Return a console of rich that prints text literally, without markup such as [red] or emoji such as :smile:."""
    return Console(markup=False, emoji=False, **options)


WIDEST = 80  # Most characters per line of a cell. Longer text is folded.

UNLIMITED = 10_000  # Characters per line: more than any table has


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
