"""The JSON file of a method: its scores on named benchmarks. The leaderboard of the documentation has these files."""

from __future__ import annotations

import datetime
import json
from importlib.metadata import version
from pathlib import Path
from typing import Any

from msgspec import Struct

from learn.benchmark.benchmark_sets import SETS
from learn.benchmark.frozen import frozen
from learn.benchmark.read_benchmark import named_benchmark
from scenes.files.atomic import write_atomically
from scenes.files.errors import InputError, shown
from scenes.files.json_yaml_xml import read_json
from scenes.files.schema import conform


class Result(Struct, kw_only=True, forbid_unknown_fields=True):
    """The scores on one benchmark."""

    scores: dict[str, float | int | None]  # by name; None where there is no value
    date: str  # day of the scores, ISO 8601
    version: str  # version of bisplat-wrf that scored
    test_sha256: str  # SHA-256 of the task's test_index.txt
    values_sha256: str  # SHA-256 of the set's values as they were frozen
    # that of the files of the predictions; None if a comparison scored them in memory
    predictions_sha256: str | None = None


class MethodResults(Struct, kw_only=True, forbid_unknown_fields=True):
    """The content of a file."""

    method: str  # name of the method
    results: dict[str, Result]  # by name of the benchmark


def read_results(path: Path) -> dict[str, Any]:
    """Read the file of a method."""
    content = read_json(path, "the scores of a method")
    conform(content, MethodResults, str(path))
    for name in content["results"]:
        try:
            named_benchmark(name)
        except InputError as error:
            raise InputError(f"{path}: {error}") from None
    return content


def add_result(path: Path, method: str, benchmark: str, scores: dict[str, Any], replaced: bool) -> None:
    """Add the scores on a benchmark to the file of a method, or begin the file."""
    content = require_room(path, method, benchmark, replaced)
    of, task = named_benchmark(benchmark)
    facts = frozen()[of]
    result = {
        "scores": {key: _rounded(value) for key, value in scores.items() if key != "predictions_sha256"},
        "date": datetime.date.today().isoformat(),
        "version": version("bisplat-wrf"),
        "test_sha256": facts["tasks"][task]["test"],
        "values_sha256": facts["values"],
    }
    if "predictions_sha256" in scores:
        result["predictions_sha256"] = scores["predictions_sha256"]
    results = {**content["results"], benchmark: result}
    order = [f"{name}-{each}" for name, one in SETS.items() for each in one.tasks]
    content["results"] = {name: results[name] for name in order if name in results}
    write_atomically(path, (json.dumps(content, indent=1, ensure_ascii=False) + "\n").encode())


def _rounded(value: float | int | None) -> float | int | None:
    """A score to six digits."""
    return float(f"{value:.6g}") if isinstance(value, float) else value


def require_room(path: Path, method: str, benchmark: str, replaced: bool) -> dict[str, Any]:
    """What is in the file of a method; an empty content if there is no such file. ``add_result`` has the arguments."""
    if not path.exists():
        return {"method": method, "results": {}}
    content = read_results(path)
    if content["method"] != method:
        raise InputError(
            f"{path}: expected the results of the method {shown(method)}, found those of {shown(content['method'])}"
        )
    if benchmark in content["results"] and not replaced:
        raise InputError(f"{path}: expected no scores on {benchmark} yet, found some; --force replaces them")
    return content
