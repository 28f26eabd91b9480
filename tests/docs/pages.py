"""The commands and snippets on the pages of the documentation, in the order in which a reader meets them.

A fenced block of ``bash`` holds commands that a reader types, and one of ``python`` a program. Other blocks (``text``,
``yaml``, ``matlab``, …) are not run. A comment before a block says why it is not run, such as
``<!-- not run: needs a GPU -->``, or that the reader saves the program: ``<!-- saved as: level.py -->``.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
FILES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
PAGES = {str(path.relative_to(ROOT)): path for path in FILES}
GENERATED = {"docs/generated/measurements.md"}
"""Its commands measure for hours; tests/benchmarks runs each at its smallest size."""

BLOCK = re.compile(
    r"^(?:<!-- not run: (?P<reason>[^\n]*?) -->\n+|<!-- saved as: (?P<file>[\w.]+) -->\n+)?"
    r"^```(?P<language>bash|python)\n(?P<text>.*?)^```$",
    re.M | re.S,
)


@dataclass(frozen=True)
class Block:
    """A block of commands or a snippet."""

    language: str  # bash or python
    text: str  # what it says
    line: int  # number of its first line in the page
    reason: str  # why tests do not run it; empty if they do
    file: str = ""  # name of the file that the reader saves it as, instead of running it; empty if the reader does not

    def commands(self) -> list[str]:
        """The commands of a block of bash, without comments, each on one line."""
        lines = re.sub(r"\\\n\s*", "", self.text).splitlines()
        return [line for line in (re.sub(r"(^|\s)#.*", "", each).strip() for each in lines) if line]


def blocks(page: str) -> list[Block]:
    """The blocks of a page (a key of ``PAGES``) that are commands or programs."""
    text = PAGES[page].read_text()
    return [
        Block(line=text.count("\n", 0, each.start("text")) + 1, **each.groupdict("")) for each in BLOCK.finditer(text)
    ]


def saved(page: str, file: str) -> str:
    """The program of a page that its reader saves as a file of this name."""
    (text,) = (block.text for block in blocks(page) if block.file == file)
    return text


def words_of_readme() -> int:
    """Words of README.md without its blocks of code."""
    return len(re.sub(r"```.*?```|<!--.*?-->", "", PAGES["README.md"].read_text(), flags=re.S).split())
