"""Bring the ledger of measured figures up to date with the runs in runs/, and write its page and the tables of others.

python -m benchmarks.results

benchmarks/ledger/sections.toml has the words and commands of the sections, and results.json beside it their figures. A
section whose command has been run in this checkout gets the figures of that run. All others stay as they are, and no
figure is typed by hand. The page is docs/generated/measurements.md. Other pages of docs/ show single tables of it, as
benchmarks/ledger/tables.py describes.
The folders of ``bisplat demo``, ``compare`` and ``crossvalidate`` do not say which machine they
were made on, so run this command there too. A section whose figures and date are the same keeps its machine.
"""

from __future__ import annotations

import json
import os
import shutil
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import tyro

from benchmarks.ledger.entry import Entry, Measured, read_entries, write_entries
from benchmarks.ledger.page import page
from benchmarks.ledger.printing import machine
from benchmarks.ledger.runs import READERS
from benchmarks.ledger.tables import with_tables
from scenes.files.errors import InputError

LEDGER = Path(__file__).with_name("ledger")
SECTIONS = LEDGER / "sections.toml"


def measured_anew(name: str, section: dict[str, Any], runs: Path, before: Entry | None) -> Measured | None:
    """The figures of a section's run; None where it has not been run, or one of the pictures it draws is missing."""
    found = READERS[section["kind"]](runs, name)
    copied = [runs / each["from"] for each in section.get("pictures", []) if "from" in each]
    if found is None or not all(path.is_file() for path in copied):
        return None
    if before is not None and (found.date, found.rows) == (before.measured.date, before.measured.rows):
        return before.measured  # the same run as last time
    return replace(found, machine=found.machine or machine()) if found.date else found


def main(
    runs: Path = Path("runs"),
    docs: Path = Path("docs"),
    ledger: Path = LEDGER / "results.json",
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Update the entries whose runs are there, and write the page."""
    entries = read_entries(ledger)
    generated = docs / "generated"
    generated.mkdir(exist_ok=True)
    written, updated = {}, []
    for name, section in tomllib.loads(SECTIONS.read_text()).items():
        before = entries.get(name)
        measured = measured_anew(name, section, runs, before)
        pictures = section.get("pictures", [])
        words = {
            "title": section["title"],
            "remarks": section.get("remarks", "").strip(),
            "pictures": {each["file"]: each["caption"] for each in pictures},
        }
        if measured is not None:
            written[name] = Entry(command=section.get("command", "").strip(), measured=measured, **words)
            for each in pictures:
                if "from" in each:
                    shutil.copyfile(runs / each["from"], generated / each["file"])
            if written[name] != before:
                updated.append(name)
        elif before is not None:
            written[name] = replace(before, **words)
    write_entries(ledger, written)
    (generated / "measurements.md").write_text(page(written))
    front = [path for path in [docs.parent / "README.md"] if path.is_file()]
    for path in {*front, *docs.rglob("*.md")} - set(generated.glob("*.md")):
        path.write_text(with_tables(path.read_text(), written, os.path.relpath(generated, path.parent)))
    kept = [name for name in written if name not in updated]
    if json_output:
        print(json.dumps({"updated": updated, "kept": kept}))
    else:
        print(f"sections updated: {', '.join(updated) or 'none'}; kept as they were: {len(kept)}")


if __name__ == "__main__":
    try:
        tyro.cli(main)
    except InputError as error:
        raise SystemExit(f"results: {error}") from None
