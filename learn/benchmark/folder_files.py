"""The files that a benchmark dataset has beside those of its format."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Literal

from learn.benchmark.benchmark_sets import SETS
from scenes.files.atomic import write_atomically
from scenes.files.errors import InputError, shown
from scenes.files.json_yaml_xml import read_json

RECORD = "benchmark.json"
"""The file that is written last, with the name of the set."""

Part = Literal["train", "test"]
PARTS: tuple[Part, ...] = ("train", "test")


def task_file(folder: Path, task: str, part: Part) -> Path:
    """The index file of a part of a task.

    >>> task_file(Path("office"), "blocked-200", "test").as_posix()
    'office/tasks/blocked-200/test_index.txt'
    """
    return folder / "tasks" / task / f"{part}_index.txt"


def record_set(folder: Path, name: str) -> None:
    """Mark a folder as a finished one of a set."""
    write_atomically(folder / RECORD, (json.dumps({"set": name}) + "\n").encode())


def is_finished(folder: Path) -> bool:
    """Whether a folder is a finished benchmark dataset."""
    return (folder / RECORD).exists()


def set_of(folder: Path) -> str:
    """The name of the set that a finished folder holds."""
    path = folder / RECORD
    if not path.exists():
        raise InputError(f"{folder}: expected a folder that bisplat benchmark made, found no {RECORD} in it")
    content = read_json(path, "the name of a benchmark dataset")
    name = content.get("set") if isinstance(content, dict) else None
    if not isinstance(name, str) or name not in SETS:
        raise InputError(f"{path}: expected the name of a benchmark dataset, found {shown(content)}")
    return name
