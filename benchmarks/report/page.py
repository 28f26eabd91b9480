"""docs/results.md, made from the entries of docs/results.json alone."""

from __future__ import annotations

import re

from report.entry import Entry, Measured

HEAD = """\
# Results

Written by `python benchmarks/results.py` from results.json, which keeps the figures of each section with the day and
the machine they were measured on. The same command brings those sections up to date whose commands have been run anew
in this checkout.
"""


def page(entries: dict[str, Entry]) -> str:
    """The page (Markdown) of these sections, in their order."""
    return "\n".join([HEAD, *(_section(entry) for entry in entries.values())])


def with_tables(text: str, entries: dict[str, Entry]) -> str:
    """A page whose tables, between <!-- table: SECTION --> and <!-- end -->, are those of the sections."""

    def table(found: re.Match[str]) -> str:
        entry = entries.get(found[1])
        return found[0] if entry is None else f"<!-- table: {found[1]} -->\n\n{_table(entry.measured)}\n\n<!-- end -->"

    return re.sub(r"<!-- table: (\S+) -->.*?<!-- end -->", table, text, flags=re.DOTALL)


def _table(measured: Measured) -> str:
    header = [measured.columns, ["---"] * len(measured.columns)]
    return "\n".join(_line(cells) for cells in [*header, *measured.rows])


def _section(entry: Entry) -> str:
    paragraphs = [f"## {entry.title}"]
    if entry.command:
        paragraphs.append(f"```\n{entry.command}\n```")
    if entry.measured.date:
        paragraphs.append(_circumstances(entry.measured))
    if entry.remarks:
        paragraphs.append(entry.remarks)
    if entry.measured.rows:
        paragraphs.append(_table(entry.measured))
    paragraphs += entry.measured.findings
    paragraphs += [f"![{caption}]({file})" for file, caption in entry.pictures.items()]
    return "\n\n".join(paragraphs) + "\n"


def _circumstances(measured: Measured) -> str:
    conditions = f"; {measured.conditions}" if measured.conditions else ""
    return f"Measured on {measured.date}, {measured.machine}{conditions}."


def _line(cells: list[str]) -> str:
    return "|" + "".join(f" {cell} |" if cell else " |" for cell in cells)
