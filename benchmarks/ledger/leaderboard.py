"""Tables of the named benchmarks, from the files of the methods in benchmarks/leaderboard/."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from benchmarks.ledger.entry import Measured
from learn.benchmark.benchmark_sets import SETS, Kind
from learn.benchmark.method_results import read_results

BOARD = Path(__file__).parents[1] / "leaderboard"

COLUMNS: dict[Kind, dict[str, tuple[str, str]]] = {
    "powers": {
        "error_median_db": ("median error (dB)", ".2f"),
        "error_p90_db": ("90th percentile (dB)", ".2f"),
        "coverage_90": ("in 90 % interval", ".3f"),
        "seconds": ("seconds", ".1f"),
    },
    "channels": {
        "snr_median_db": ("median SNR (dB)", ".1f"),
        "snr_p10_db": ("10th percentile (dB)", ".1f"),
        "correlation_median": ("correlation", ".4f"),
        "delay_spread_error_median_ns": ("delay spread off (ns)", ".1f"),
        "coverage_90": ("in 90 % interval", ".3f"),
        "seconds": ("seconds", ".1f"),
    },
    "spectra": {
        "ssim_median": ("median SSIM", ".3f"),
        "ssim_p05": ("5th percentile", ".3f"),
        "psnr_mean": ("PSNR (dB)", ".1f"),
        "aoa_error_median_deg": ("error of the strongest direction (°)", ".1f"),
        "seconds": ("seconds", ".1f"),
    },
}
"""Scores of a table, with heading and format; the first one ranks the methods."""

SMALLEST_FIRST = {"error_median_db"}

MISSING = "–"

MACHINES = "each method on the machine of those who sent it"
"""Seconds of different methods are of different machines."""


def leaderboard(runs: Path, name: str) -> Measured | None:
    """The first score of every method on every task of a set; ``name`` is "leaderboard-" and the set's name."""
    of = name.removeprefix("leaderboard-")
    found = _results(of)
    if not found:
        return None
    kind, tasks = SETS[of].kind, list(SETS[of].tasks)
    first = next(iter(COLUMNS[kind]))
    methods = sorted({method for method, _ in found}, key=lambda method: _rank(found.get((method, tasks[-1])), first))
    rows = [[method, *(_cell(found.get((method, task)), kind, first) for task in tasks)] for method in methods]
    return Measured(_date(found), MACHINES, columns=["", *tasks], rows=rows)


def scores(runs: Path, name: str) -> Measured | None:
    """All scores on every task of a set; ``name`` is "scores-" and the set's name."""
    of = name.removeprefix("scores-")
    found = _results(of)
    if not found:
        return None
    kind = SETS[of].kind
    first, rows = next(iter(COLUMNS[kind])), []
    for task in SETS[of].tasks:
        methods = [method for method, each in found if each == task]
        for method in sorted(methods, key=lambda method: _rank(found[method, task], first)):
            rows.append([task, method, *(_cell(found[method, task], kind, key) for key in COLUMNS[kind])])
    headings = [heading for heading, _ in COLUMNS[kind].values()]
    return Measured(_date(found), MACHINES, columns=["task", "method", *headings], rows=rows)


def _results(of: str) -> dict[tuple[str, str], dict[str, Any]]:
    """The results on a set by method and task."""
    found = {}
    for path in sorted(BOARD.glob("*.json")):
        content = read_results(path)
        for task in SETS[of].tasks:
            if f"{of}-{task}" in content["results"]:
                found[content["method"], task] = content["results"][f"{of}-{task}"]
    return found


def _date(found: dict[tuple[str, str], dict[str, Any]]) -> str:
    return max(each["date"] for each in found.values())


def _rank(result: dict[str, Any] | None, score: str) -> float:
    value = None if result is None else result["scores"].get(score)
    if value is None:
        return float("inf")
    return value if score in SMALLEST_FIRST else -value


def _cell(result: dict[str, Any] | None, kind: Kind, score: str) -> str:
    value = None if result is None else result["scores"].get(score)
    return MISSING if value is None else format(value, COLUMNS[kind][score][1])
