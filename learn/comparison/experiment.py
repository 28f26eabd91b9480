"""One row of a results file: a method fitted and scored. Rows are appended once and never made again."""

from __future__ import annotations

import csv
import datetime
import json
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Int
from rich.console import Console

from learn.baselines.array_ceiling import SAMPLES, array_ceiling
from learn.comparison.methods import Method, Task
from learn.metrics import Scores, score
from learn.output_folder import claim
from learn.splits import evenly, split
from scenes.atomic import write_atomically
from simulate.dataset import Dataset

CEILING = "array's ceiling"


@dataclass(frozen=True)
class Protocol:
    """What the rows of a table have in common, and a results file is for.

    Attributes:
        dataset: folder, absolute.
        split: how the test part is chosen.
        split_seed: of the split.
        minutes: of training, for each method that learns; None: as many as the steps take.
        steps: of training, for each model trained by steps; None: as many as the minutes hold.
        device: what it trains on.
    """

    dataset: str
    split: str
    split_seed: int
    minutes: float | None
    steps: int | None
    device: str


class Experiment:
    """A folder of results: protocol.json, results.jsonl, per_sample/, and what methods leave in runs/.

    Args:
        folder: new, or of an experiment begun before under the same protocol.
        dataset: what is trained and tested on.
        protocol: as it will be written, or must be what is there.

    Raises:
        InputError: the folder holds another experiment, or something else.
    """

    def __init__(self, folder: Path, dataset: Dataset, protocol: Protocol):
        self.folder, self.dataset, self.protocol = folder, dataset, protocol
        path = folder / "protocol.json"
        begun = json.loads(path.read_text()) if path.exists() else None
        given = {key: value for key, value in asdict(protocol).items() if value is not None}
        claim(folder, "experiment", given, begun)
        write_atomically(path, (json.dumps(given, indent=2) + "\n").encode())

    @property
    def rows(self) -> list[dict[str, Any]]:
        """What has been measured so far."""
        path = self.folder / "results.jsonl"
        return [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []

    def run(self, label: str, make: Callable[[], Method], seed: int = 0, train_size: int | None = None) -> None:
        """Fit and score a method, unless there is such a row."""
        key = {"label": label, "seed": seed, "train_size": train_size}
        if self._has(key):
            return
        name = _name(key)
        Console(stderr=True).print(f"bisplat: {name}")
        kind: Any = self.protocol.split
        folder = self.folder / "runs" / name
        protocol = self.protocol
        task = Task(self.dataset, kind, protocol.split_seed, train_size, seed, protocol.minutes, protocol.steps, folder)
        method = make()
        began = time.perf_counter()
        method.fit(task)
        seconds = getattr(method, "seconds", time.perf_counter() - began)
        test = task.parts.test
        positions = self.dataset.positions[test]
        began = time.perf_counter()
        prediction = method.predict(positions)
        milliseconds = 1e3 * (time.perf_counter() - began) / len(positions)
        scores = score(np.clip(prediction, 0, 1), self._truth(test))
        cost = {
            "train": len(task.parts.train),
            "parameters": getattr(method, "parameters", None),
            "training_seconds": round(seconds, 1),
            "milliseconds_per_spectrum": round(milliseconds, 2),
        }
        self._keep(key, test, scores, cost)

    def run_ceiling(self) -> None:
        """The row of the array's ceiling: fitted to the test pictures themselves, so no method but a bound."""
        key = {"label": CEILING, "seed": 0, "train_size": None}
        if self._has(key):
            return
        kind: Any = self.protocol.split
        some = evenly(split(self.dataset, kind, self.protocol.split_seed).test, SAMPLES)
        self._keep(key, some, score(array_ceiling(self._truth(some), self.dataset.array), self._truth(some)), {})

    def per_sample(self, row: dict[str, Any]) -> dict[str, Float[np.ndarray, " K"]]:
        """Columns of a row's CSV: ssim, psnr_db, mae, aoa_error_deg."""
        with (self.folder / "per_sample" / f"{_name(row)}.csv").open(newline="") as file:
            table = list(csv.DictReader(file))
        return {column: np.array([float(line[column]) for line in table]) for column in table[0] if column != "name"}

    def _has(self, key: dict[str, Any]) -> bool:
        return any(key.items() <= row.items() for row in self.rows)

    def _truth(self, test: Int[np.ndarray, " K"]) -> Float[np.ndarray, "K 90 360"]:
        return self.dataset.pictures[test] / np.float32(255)

    def _keep(self, key: dict[str, Any], test: Int[np.ndarray, " K"], scores: Scores, cost: dict[str, Any]) -> None:
        text = StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(["name", "ssim", "psnr_db", "mae", "aoa_error_deg"])
        columns = (scores.ssim, scores.psnr, scores.mae, scores.aoa_error)
        for index, *figures in zip(test, *columns, strict=True):
            writer.writerow([self.dataset.names[index], *(f"{figure:.6f}" for figure in figures)])
        write_atomically(self.folder / "per_sample" / f"{_name(key)}.csv", text.getvalue().encode())
        row = {**key, "test": len(test), **scores.summary(), **cost, "date": datetime.date.today().isoformat()}
        path = self.folder / "results.jsonl"
        lines = [json.dumps(each) for each in (*self.rows, row)]
        write_atomically(path, ("\n".join(lines) + "\n").encode())


def _name(key: dict[str, Any]) -> str:
    """A row's name in the file system."""
    size = "" if key["train_size"] is None else f"-{key['train_size']}"
    return f"{key['label'].replace(' ', '_').replace('/', '_')}{size}-{key['seed']}"


def summary(rows: list[dict[str, Any]], by: Callable[[dict[str, Any]], Any]) -> dict[Any, dict[str, float]]:
    """Over the seeds: mean of every figure, and of ssim_median also its standard deviation (``ssim_spread``)."""
    groups: dict[Any, list[dict[str, Any]]] = {}
    for row in rows:
        groups.setdefault(by(row), []).append(row)
    result = {}
    for name, group in groups.items():
        figures = [key for key, value in group[0].items() if isinstance(value, int | float) and key != "seed"]
        result[name] = {key: float(np.mean([row[key] for row in group])) for key in figures}
        medians = [row["ssim_median"] for row in group]
        result[name] |= {"seeds": len(group), "ssim_spread": float(np.std(medians, ddof=1)) if len(group) > 1 else 0.0}
    return result
