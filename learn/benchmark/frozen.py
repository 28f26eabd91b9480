"""What a benchmark dataset must be: hashes of its positions and index files, and some of its values."""

from __future__ import annotations

import hashlib
import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from learn.benchmark.benchmark_sets import SETS, Kind
from learn.benchmark.folder_files import PARTS, task_file
from scenes.files.atomic import write_atomically
from scenes.files.errors import InputError
from simulate.csi.csi_dataset import inspect_csi
from simulate.dataset.dataset_kinds import CHANNELS, POWERS
from simulate.dataset.picture_files import read_pictures
from simulate.rssi.rssi_dataset import inspect_rssi

FACTS = Path(__file__).with_name("frozen.json")
"""The frozen facts of every set."""

ROWS = 10
"""Rows whose values are kept, evenly spread."""

TOLERANCE: dict[Kind, float] = {"spectra": 1.0, "powers": 0.25, "channels": 0.01}
"""Largest mean difference of the kept values: grey levels of 255, dB, and relative to the root mean square.

Machines and versions of the ray tracer differ by less; another scene or other positions differ by far more.
"""


def freeze(name: str, folder: Path) -> None:
    """Keep the facts of a set that has just been defined. Once published they never change; a change gets a new name"""
    facts = {**frozen(), name: facts_of(name, folder)}
    text = json.dumps({each: facts[each] for each in SETS if each in facts}, indent=None, separators=(",", ":"))
    write_atomically(FACTS, (text.replace('},"', '},\n"') + "\n").encode())
    frozen.cache_clear()


@cache
def frozen() -> dict[str, Any]:
    """The frozen facts of every set, by name."""
    return json.loads(FACTS.read_text(encoding="utf-8")) if FACTS.is_file() else {}


def facts_of(name: str, folder: Path) -> dict[str, Any]:
    """The facts of a folder: "positions" and "tasks" (SHA-256 of files), "values" (SHA-256), "sample" (kept values)."""
    wanted = SETS[name]
    tasks = {task: {part: _digest(task_file(folder, task, part)) for part in PARTS} for task in wanted.tasks}
    values, sample = _values(wanted.kind, folder)
    return {"positions": _digest(folder / "tx_pos.csv"), "tasks": tasks, "values": values, "sample": sample}


def require_frozen(name: str, folder: Path) -> str:
    """Refuse a folder that differs from the frozen set."""
    found, wanted = facts_of(name, folder), frozen()[name]
    exactly = f"expected exactly those of the benchmark dataset {name}, found others"
    if found["positions"] != wanted["positions"]:
        raise InputError(f"{folder / 'tx_pos.csv'}: {exactly}")
    for task, parts in wanted["tasks"].items():
        for part in PARTS:
            if found["tasks"][task][part] != parts[part]:
                raise InputError(f"{task_file(folder, task, part)}: {exactly}")
    if found["values"] == wanted["values"]:
        return f"identical to the frozen benchmark dataset {name}"
    kind = SETS[name].kind
    difference, limit = _difference(kind, np.array(found["sample"]), np.array(wanted["sample"])), TOLERANCE[kind]
    of = {"spectra": "grey levels", "powers": "dB", "channels": "of the root mean square"}[kind]
    if not difference <= limit:
        raise InputError(
            f"{folder}: expected values within {limit:g} {of} of the benchmark dataset {name}, found a mean difference "
            f"of {difference:.3g}"
        )
    return f"the frozen benchmark dataset {name}, with values that differ by {difference:.2g} {of}, as machines do"


def _difference(kind: Kind, found: Float[np.ndarray, "..."], wanted: Float[np.ndarray, "..."]) -> float:
    """Mean difference of kept values; infinite if their numbers differ."""
    if found.shape != wanted.shape:
        return float("inf")
    if kind == "channels":
        return float(np.linalg.norm(found - wanted) / np.linalg.norm(wanted))
    return float(np.abs(found - wanted).mean())


def _values(kind: Kind, folder: Path) -> tuple[str, list[Any]]:
    """SHA-256 of all values, and those that are kept."""
    if kind == "spectra":
        problems: list[str] = []
        _, pictures = read_pictures(folder / "spectrum", problems)
        if problems:
            raise InputError(problems[0])
        chosen = pictures[_spread(len(pictures))].astype(float)
        blocks = chosen.reshape(len(chosen), 6, 15, 12, 30).mean(axis=(2, 4))
        return hashlib.sha256(np.ascontiguousarray(pictures).data).hexdigest(), blocks.round(1).tolist()
    if kind == "powers":
        powers = inspect_rssi(folder).usable().rssi_dbm
        return _digest(folder / POWERS), np.nan_to_num(powers[_spread(len(powers))], nan=-100.0).tolist()
    csi = inspect_csi(folder).usable()
    both = np.concatenate([csi.uplink, csi.downlink], axis=-1)[_spread(len(csi)), ::3, ::17]
    parts = np.stack([both.real, both.imag]).ravel().tolist()
    return _digest(folder / CHANNELS), [float(f"{part:.4g}") for part in parts]


def _spread(count: int) -> np.ndarray:
    return np.linspace(0, count - 1, ROWS).astype(int)


def _digest(path: Path) -> str:
    if not path.is_file():
        raise InputError(f"{path}: expected a file of a benchmark dataset, found nothing there")
    return hashlib.sha256(path.read_bytes()).hexdigest()
