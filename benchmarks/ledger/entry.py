"""A section of the page as results.json keeps it: its words, and its figures as they were last measured."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from scenes.files.atomic import write_atomically


@dataclass(frozen=True)
class Measured:
    """The figures of a section."""

    date: str = ""  # day of the measurement, YYYY-MM-DD; empty where the section has no figures
    machine: str = ""  # processor, operating system and version of Python; empty where the run does not say
    conditions: str = ""  # what else the figures depend on, such as threads and steps
    columns: list[str] = field(default_factory=list)  # heading of each column
    rows: list[list[str]] = field(default_factory=list)  # cells of each row, as they stand on the page
    findings: list[str] = field(default_factory=list)  # what follows from the figures, a paragraph each (Markdown)


@dataclass(frozen=True)
class Entry:
    """A section."""

    title: str  # heading
    command: str  # what made the figures, as typed; may be of several lines, or empty
    remarks: str  # what a reader has to know (Markdown), or empty
    pictures: dict[str, str]  # name of each picture's file, beside the page -> its caption
    measured: Measured  # the figures


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
