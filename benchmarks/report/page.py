"""docs/measurements.md, made from the entries of docs/results.json alone."""

from __future__ import annotations

from report.entry import Entry, Measured
from report.tables import markdown

HEAD = """\
# Measurements

Every figure of these pages, with the command that made it, the day and the machine; [results.md](results.md) has the
answers. `python benchmarks/results.py` writes this page from results.json, and brings those sections up to date whose
commands have been run anew in this checkout.
"""


def page(entries: dict[str, Entry]) -> str:
    """The page (Markdown) of these sections, in their order."""
    return "\n".join([HEAD, *(_section(name, entry) for name, entry in entries.items())])


def _section(name: str, entry: Entry) -> str:
    paragraphs = [f'<a id="{name}"></a>', f"## {entry.title}"]
    if entry.command:
        paragraphs.append(f"```\n{entry.command}\n```")
    if entry.measured.date:
        paragraphs.append(_circumstances(entry.measured))
    if entry.remarks:
        paragraphs.append(entry.remarks)
    if entry.measured.rows:
        paragraphs.append(markdown([entry.measured.columns, *entry.measured.rows]))
    paragraphs += entry.measured.findings
    paragraphs += [f"![{caption}]({file})" for file, caption in entry.pictures.items()]
    return "\n\n".join(paragraphs) + "\n"


def _circumstances(measured: Measured) -> str:
    conditions = f"; {measured.conditions}" if measured.conditions else ""
    return f"Measured on {measured.date}, {measured.machine}{conditions}."
