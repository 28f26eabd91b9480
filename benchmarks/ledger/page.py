"""The page docs/generated/measurements.md, made from the entries of results.json alone."""

from __future__ import annotations

from benchmarks.ledger.entry import Entry, Measured
from benchmarks.ledger.tables import markdown

HEAD = """\
# Measurements

This page has every measured figure, with its command, the day and the machine. [Results](../results.md) says what
follows from them. `python -m benchmarks.results` writes this page, and updates the sections whose commands have been
run again in this checkout.

Commands with `data/rfid-s23-160` need a published sample of measured spectra.
[Use my own measurements](../how-to/use-my-own-measurements.md) says where to get it.
"""


def page(entries: dict[str, Entry]) -> str:
    """The page (Markdown) of these sections, in their order."""
    return "\n".join([HEAD, *map(_section, entries.values())])


def _section(entry: Entry) -> str:
    paragraphs = [f"## {entry.title}"]
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
