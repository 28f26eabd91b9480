"""docs/results.md, made from the entries of docs/results.json alone."""

from __future__ import annotations

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


def _section(entry: Entry) -> str:
    paragraphs = [f"## {entry.title}"]
    if entry.command:
        paragraphs.append(f"```\n{entry.command}\n```")
    if entry.measured.date:
        paragraphs.append(_circumstances(entry.measured))
    if entry.remarks:
        paragraphs.append(entry.remarks)
    if entry.measured.rows:
        header = [entry.measured.columns, ["---"] * len(entry.measured.columns)]
        paragraphs.append("\n".join(_line(cells) for cells in [*header, *entry.measured.rows]))
    paragraphs += entry.measured.findings
    paragraphs += [f"![{caption}]({file})" for file, caption in entry.pictures.items()]
    return "\n\n".join(paragraphs) + "\n"


def _circumstances(measured: Measured) -> str:
    conditions = f"; {measured.conditions}" if measured.conditions else ""
    return f"Measured on {measured.date}, {measured.machine}{conditions}."


def _line(cells: list[str]) -> str:
    return "|" + "".join(f" {cell} |" if cell else " |" for cell in cells)
