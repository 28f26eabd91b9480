"""Score our methods on the named benchmark datasets, and keep the scores for the leaderboard.

python -m benchmarks.learn.quantity_tables --json > runs/quantity_tables.json

Datasets that are not there yet are made, which takes minutes each. Powers and channels are compared by
``compare_powers`` and ``compare_channels``. Of spectra, the predictions are written, and scored as those of others are.
Seconds are those of fit and predictions. Each method has a file in benchmarks/leaderboard/, which
benchmarks/results.py reads.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro

from benchmarks.ledger.printing import print_figures
from learn.benchmark.benchmark_sets import SETS

BOARD = Path(__file__).parents[1] / "leaderboard"

OF_SPECTRA = "mean-picture", "nearest", "inverse-distance", "kriging", "kriging-responses", "helmholtz"
"""Methods for spectra. None is trained by steps."""


def of_links(benchmark: str, folder: Path, powers: bool) -> Iterator[tuple[str, dict[str, Any]]]:
    """Every method for powers or channels, and its scores."""
    from learn.benchmark.read_benchmark import read_benchmark
    from learn.channels.compare_channels import compare_channels
    from learn.powers.compare_powers import compare_powers

    comparison = (compare_powers if powers else compare_channels)(read_benchmark(benchmark, folder), split="files")
    for row in comparison.rows:
        yield row["label"], {key: value for key, value in row.items() if key != "label"}


def of_spectra(
    benchmark: str, folder: Path, methods: tuple[str, ...], temporary: Path
) -> Iterator[tuple[str, dict[str, Any]]]:
    """Each method for spectra, and the scores of what it predicts; it is fitted to each frequency by itself."""
    from learn.benchmark.benchmark_sets import benchmarks
    from learn.benchmark.read_benchmark import read_benchmark
    from learn.benchmark.score_predictions import score_predictions
    from learn.comparison.methods import method_named
    from learn.comparison.task import Task

    frequencies = SETS[benchmarks()[benchmark].of].frequencies or (None,)
    datasets = [read_benchmark(benchmark, folder, frequency) for frequency in frequencies]
    for name in methods:
        place = temporary / benchmark / name
        place.mkdir(parents=True)
        began, predicted = time.perf_counter(), []
        for number, dataset in enumerate(datasets):
            method = method_named(name)()
            method.fit(Task(dataset, "files", 0, None, 0, 5.0, None, place / f"own-{number}"))
            predicted.append(method.predict(dataset.positions[dataset.test]))
        seconds = time.perf_counter() - began
        np.save(place / "spectra.npy", np.concatenate(predicted).astype(np.float32))
        scores = score_predictions(place, folder, benchmark)
        yield name, {**scores, "seconds": round(seconds, 2)}


def main(
    sets: tuple[str, ...] = tuple(name for name in SETS if name != "practice"),
    folder: Path = Path("runs/benchmarks"),
    leaderboard: Path = BOARD,
    smallest: bool = False,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Make the datasets, score the methods on every task, and write their files."""
    from learn.benchmark.make_benchmark import make_benchmark
    from learn.benchmark.method_results import add_result

    figures: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as name:
        temporary = Path(name)
        if smallest:
            sets, folder, leaderboard = ("practice",), temporary, temporary
        methods = OF_SPECTRA[:2] if smallest else OF_SPECTRA
        for each in sets:
            make_benchmark(each, folder / each)
            for task in SETS[each].tasks:
                benchmark = f"{each}-{task}"
                if SETS[each].kind == "spectra":
                    scored = of_spectra(benchmark, folder / each, methods, temporary)
                else:
                    scored = of_links(benchmark, folder / each, SETS[each].kind == "powers")
                for method, scores in scored:
                    add_result(leaderboard / f"{method}.json", method, benchmark, scores, replaced=True)
                    shown = {key: value for key, value in scores.items() if isinstance(value, float)}
                    figures[f"{benchmark}, {method}"] = {key: float(f"{value:.4g}") for key, value in shown.items()}
    print_figures(figures, json_output, smallest)


if __name__ == "__main__":
    tyro.cli(main)
