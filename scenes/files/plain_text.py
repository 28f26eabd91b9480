"""Text from files, such as the name of a scene or a folder, shown as it is: not as markup, formula or command."""

from __future__ import annotations

import re
import sys

from rich.console import Console

from scenes.files.errors import SHOWN, cut, printable


def in_figure(text: str) -> str:
    r"""Text for a figure of Matplotlib: without formulas, on one line, and cut if long.

    Args:
        text: any text. One that begins with "_" gets a space in front: Matplotlib leaves such labels out of legends.

    >>> print(in_figure(r"$\frac{$"), in_figure("a\nb"))
    \$\frac{\$ a\nb
    """
    plain = cut(text).replace("$", r"\$")
    return f" {plain}" if plain.startswith("_") else plain


def in_markdown(text: str) -> str:
    r"""Text for a panel of the viewer, which reads Markdown and HTML.

    Args:
        text: any text.

    >>> print(in_markdown("[a](b) <c>"))
    \[a\]\(b\) \<c\>
    """
    return re.sub(r"([!-/:-@\[-`{-~])", r"\\\1", printable(text))


LONGEST_WORD = 300
"""Characters; a longer word, such as a path that no file system has, is cut."""


def say(sentence: str) -> None:
    """Print a sentence to the user on stderr, after the name of the program.

    Args:
        sentence: any text; its control characters are escaped, and words that no reader wants are cut.
    """
    short = re.sub(rf"\S{{{LONGEST_WORD},}}", lambda word: f"{word[0][:SHOWN]}…{word[0][-SHOWN:]}", sentence)
    print(f"bisplat: {printable(short)}", file=sys.stderr)


def plain_console(**options) -> Console:
    """A console of rich that takes text as it is, without markup such as [red] and without emoji such as :smile:."""
    return Console(markup=False, emoji=False, **options)
