"""How complete is the documentation?

python -m benchmarks.product.pages --json

Counted: words of the README; pages of each kind; commands and snippets on them, and how many of these the tests run;
public names, and how many of these the reference documents with an example; warnings of a strict build, broken links
among them.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Annotated

import tyro

import bisplat
from benchmarks.ledger.printing import print_figures
from tests.docs.api_pages import undocumented, without_example
from tests.docs.pages import GENERATED, PAGES, blocks, words_of_readme

ROOT = Path(__file__).parents[2]

KINDS = ("start", "how-to", "understand", "reference")


def main(
    smallest: bool = False,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Count."""
    figures: dict[str, int | None] = {"words of the README": words_of_readme()}
    for kind in KINDS:
        figures[f"pages: {kind}"] = sum(page.startswith(f"docs/{kind}/") for page in PAGES)
    figures["pages: start"] = (figures["pages: start"] or 0) + 1  # the notebook
    every = [block for page in PAGES if page not in GENERATED for block in blocks(page)]
    for language, what in (("bash", "commands"), ("python", "snippets")):
        found = [block for block in every if block.language == language]
        count = [len(block.commands()) if language == "bash" else 1 for block in found]
        figures[f"{what} on pages"] = sum(count)
        figures[f"{what} run by tests"] = sum(n for n, block in zip(count, found, strict=True) if not block.reason)
    figures["public names"] = len(bisplat.__all__)
    lacking = {name.rpartition(".")[2] for name in undocumented()} | without_example()
    figures["public names documented, with an example"] = len(bisplat.__all__) - len(lacking)
    figures["warnings of the strict build, broken links among them"] = None if smallest else warnings()
    print_figures(figures, json_output, smallest)


def warnings() -> int:
    """Warnings of a whole build of the site."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "sphinx", "-q", "--keep-going", "-d", f"{folder}/trees", ROOT / "docs"]
        done = subprocess.run([*command, f"{folder}/site"], capture_output=True, text=True, cwd=ROOT)
    if done.returncode:
        raise SystemExit(done.stderr)
    return len(re.findall("WARNING|ERROR", done.stderr))


if __name__ == "__main__":
    tyro.cli(main)
