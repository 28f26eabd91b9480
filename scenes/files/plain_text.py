"""Show text from files, such as the name of a scene, literally: not as markup, formulas or terminal commands."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from rich.console import Console

from scenes.files.errors import SHOWN, cut, printable


def in_figure(text: str) -> str:
    r"""Format text for a figure of Matplotlib: without formulas, on one line, and cut if long.

    >>> print(in_figure(r"$\frac{$"), in_figure("a\nb"))
    \$\frac{\$ a\nb
    """
    plain = cut(text).replace("$", r"\$")
    return f" {plain}" if plain.startswith("_") else plain


def in_markdown(text: str) -> str:
    r"""Escape text for a panel of the viewer, which reads Markdown and HTML.

    >>> print(in_markdown("[a](b) <c>"))
    \[a\]\(b\) \<c\>
    """
    return re.sub(r"([!-/:-@\[-`{-~])", r"\\\1", printable(text))


LONGEST_WORD = 300
"""Most characters of a word. A longer one, such as an impossible path, is cut."""


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
