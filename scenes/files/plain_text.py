"""Show text from files, such as the name of a scene, literally: not as markup, formulas or terminal commands.

Tables on stdout are folded to the width of a terminal, or as wide as needed in a file or pipe; never cut.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable, Iterator
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
    # A narrow terminal would break inverse-distance in the middle of a word.
    dash = "-\n" if sys.stdout.isatty() else "-"
    headings = [printable(name.replace("_", " ")).replace("-", dash) for name in columns]
    rows = ([row, *(column.get(row, "") for column in columns.values())] for row in next(iter(columns.values())))
    _print(title, ["", *headings], rows)


def print_rows(title: str, rows: list[dict]) -> None:
    _print(title, map(printable, rows[0]), (row.values() for row in rows))


def _print(title: str, headings: Iterable[str], rows: Iterable[Iterable[object]]) -> None:
    table = Table(title=printable(title))
    for heading in headings:
        table.add_column(heading, overflow="fold", max_width=WIDEST)
    for row in rows:
        table.add_row(*map(_cell, row))
    # Without a terminal, rich would assume a width of 80.
    plain_console(width=None if sys.stdout.isatty() else UNLIMITED).print(table)


def _cell(value: object) -> str:
    if value is None:
        return "–"
    return f"{value:.4g}" if isinstance(value, float) else printable(str(value))
