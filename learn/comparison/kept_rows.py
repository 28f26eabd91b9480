"""The rows of a comparison in a file, each kept as soon as it is measured, so that none is measured twice."""

from __future__ import annotations

import json
import os
from collections.abc import Container, Iterable, Mapping
from pathlib import Path
from typing import Annotated, Any

from msgspec import Meta, Struct

from scenes.files.atomic import write_atomically
from scenes.files.errors import InputError, shown
from scenes.files.input_file import MEGABYTE, read_text
from scenes.files.json_yaml_xml import parse_json, plain_number
from scenes.files.plain_text import say
from scenes.files.schema import conform

RESULTS = "results.jsonl"
"""Name of the file."""

LARGEST_RESULTS = 64 * MEGABYTE
"""Largest size of the file, bytes; a row takes about 400."""


class KeptRow(Struct, frozen=True, kw_only=True):
    """The entries of a row's key, and so of every row."""

    label: str
    seed: Annotated[int, Meta(ge=0)]
    train_size: Annotated[int, Meta(ge=1)] | None


class KeptRows:
    """The rows in ``results.jsonl``, a JSON object per line.

    A row has a *key*, its label, seed and number of training spectra. No two rows have the same key.
    """

    def __init__(self, folder: Path, schema: type[KeptRow]):
        self.path, self._schema = folder / RESULTS, schema

    @property
    def rows(self) -> list[dict[str, Any]]:
        """The rows measured so far, in the order in which they were measured."""
        if not os.path.lexists(self.path):
            return []
        rows = []
        lines = read_text(self.path, "a JSON object per line", LARGEST_RESULTS).splitlines()
        for number, line in enumerate(lines, start=1):
            place = f"{self.path}, line {number}"
            rows.append(parse_json(line, place, "the scores of a method", nan=True))
            conform(rows[-1], self._schema, place)
        return rows

    def row(self, key: dict[str, Any]) -> dict[str, Any] | None:
        """The row with this key. None: it has not been measured."""
        return next((row for row in self.rows if key.items() <= row.items()), None)

    def require_file_names(self, labels: Iterable[str]) -> None:
        """Refuse labels whose files would have the name of another label's, of this call or of a row that is kept."""
        by_name: dict[str, str] = {}
        for label in [*(row["label"] for row in self.rows), *labels]:
            other = by_name.setdefault(_file_name(label), label)
            if other != label:
                raise InputError(
                    f"{self.path}: expected labels whose files have names of their own, found {shown(label)} beside "
                    f"{shown(other)}"
                )

    def is_measured(self, key: dict[str, Any], name: str, own: bool, source: str | None, ours: Container[str]) -> bool:
        """Whether a row has been measured; not if its method was another one or has been edited since.

        What is decided is said.
        """
        row = self.row(key)
        if row is None or not (own or source is not None or "source" in row):
            return row is not None
        if own and source is None:
            say(f"{name}: measured before and kept; no source tells whether its class has changed since")
        elif "source" not in row and not (own and key["label"] in ours):  # unless the row is of ours with this name
            say(f"{name}: measured before and kept; an older version kept nothing that tells whether it has changed")
        elif row.get("source") != source:
            say(f"{name}: it or its settings have changed, so it is measured again and its old row is replaced")
            return False
        return True

    def keep(self, key: dict[str, Any], row: dict[str, Any]) -> None:
        """Write a row with its key to the file, in place of an old one with this key."""
        rows, old, new = self.rows, self.row(key), {**key, **row}
        kept = [*rows, new] if old is None else [new if each == old else each for each in rows]
        write_atomically(
            self.path, ("\n".join(json.dumps(each, default=plain_number) for each in kept) + "\n").encode()
        )


def row_name(row: Mapping[str, Any]) -> str:
    """Name of a row's file in per_sample/.

    >>> row_name({"label": "bisplat without BST", "seed": 2, "train_size": 200})
    'bisplat_without_BST-200-2'
    """
    size = "" if row["train_size"] is None else f"-{row['train_size']}"
    return f"{_file_name(row['label'])}{size}-{row['seed']}"


def _file_name(label: str) -> str:
    return label.replace(" ", "_").replace("/", "_")


def run_folder(row: Mapping[str, Any]) -> Path:
    """Folder of a row's run below that of the comparison.

    It has another name for each version of a method that may change, so that none goes on with the weights of another.

    >>> run_folder({"label": "ours", "seed": 0, "train_size": None, "source": "0123456789abcdef"}).as_posix()
    'runs/ours-0-01234567'
    """
    source = row.get("source")
    return Path("runs") / (row_name(row) if source is None else f"{row_name(row)}-{source[:8]}")
