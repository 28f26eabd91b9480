"""A section of the page as results.json keeps it: its words, and its figures as they were last measured."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from scenes.files.atomic import write_atomically


@dataclass(frozen=True)
class Measured:
    """The figures of a section.

    Attributes:
        date: day of the measurement, YYYY-MM-DD; empty where the section has no figures.
        machine: processor, operating system and version of Python; empty where the run does not say.
        conditions: what else the figures depend on, such as threads and steps.
        columns: heading of each column.
        rows: cells of each row, as they stand on the page.
        findings: what follows from the figures, a paragraph each (Markdown).
    """

    date: str = ""
    machine: str = ""
    conditions: str = ""
    columns: list[str] = field(default_factory=list)
    rows: list[list[str]] = field(default_factory=list)
    findings: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Entry:
    """A section.

    Attributes:
        title: heading.
        command: what made the figures, as typed; may be of several lines, or empty.
        remarks: what a reader has to know (Markdown), or empty.
        pictures: name of each picture's file, beside the page -> its caption.
        measured: the figures.
    """

    title: str
    command: str
    remarks: str
    pictures: dict[str, str]
    measured: Measured


def read_entries(path: Path) -> dict[str, Entry]:
    """The entries of a results.json by the section's name; none where there is no such file."""
    if not path.is_file():
        return {}
    content = json.loads(path.read_text())
    return {name: Entry(**{**entry, "measured": Measured(**entry["measured"])}) for name, entry in content.items()}


def write_entries(path: Path, entries: dict[str, Entry]) -> None:
    """Write results.json, a row of a table to the line, so that a changed figure is a changed line."""
    write_atomically(path, (_text({name: asdict(entry) for name, entry in entries.items()}) + "\n").encode())


def _text(value: Any, indent: str = "") -> str:
    """JSON with every entry of an object and of a list of lists on a line of its own, and other lists on one line."""
    inner = indent + " "
    if isinstance(value, dict) and value:
        lines = [f"{inner}{json.dumps(key, ensure_ascii=False)}: {_text(each, inner)}" for key, each in value.items()]
        return "{\n" + ",\n".join(lines) + f"\n{indent}}}"
    if isinstance(value, list) and value and isinstance(value[0], list):
        return "[\n" + ",\n".join(f"{inner}{_text(each)}" for each in value) + f"\n{indent}]"
    return json.dumps(value, ensure_ascii=False)
