"""The commands of named benchmark datasets: benchmark, score."""

from __future__ import annotations

import json as json_format
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from bisplat.commands.given_options import refuse_given
from bisplat.commands.output_file import Force
from learn.benchmark.benchmark_sets import SETS
from scenes.files.atomic import require_writable
from scenes.files.errors import InputError, ParameterError, printable, require_word
from scenes.files.plain_text import print_rows, print_table


def benchmark(
    name: Annotated[Positional[str | None], arg(metavar="NAME")] = None,
    output: Annotated[Path | None, arg(aliases=["-o"])] = None,
    json: bool = False,
) -> None:
    """Make a named benchmark dataset, or list them.

    If the command is interrupted, the same command continues. On a finished folder it checks that nothing differs.

    Args:
        name: name of the dataset (default: list all datasets and their tasks).
        output: the new folder.
        json: print the list as JSON.
    """
    if name is None:
        refuse_given(["-o", "--output"], "the name of a benchmark dataset beside it, found none")
        if json:
            listed = {each: {"about": one.about, "tasks": list(one.tasks)} for each, one in SETS.items()}
            print(json_format.dumps(listed, indent=2, ensure_ascii=False))
            return
        rows = [{"name": each, "dataset": one.about, "tasks": ", ".join(one.tasks)} for each, one in SETS.items()]
        print_rows("benchmark datasets; a benchmark is NAME-TASK, such as lab-blocked", rows)
        return
    require_word(SETS, name=name)
    refuse_given(["--json", "--no-json"], f"the list, which has no name, found {name}")
    if output is None:
        raise InputError("-o: expected a folder for the dataset, found none")
    from learn.benchmark.make_benchmark import make_benchmark

    print(printable(f"{make_benchmark(name, output)}"))


def score(
    predictions: Positional[Path],
    dataset: Positional[Path],
    benchmark: str,
    method: str | None = None,
    output: Annotated[Path | None, arg(aliases=["-o"])] = None,
    force: Force = False,
    json: bool = False,
) -> None:
    """Score predictions of another program on a named benchmark.

    Args:
        predictions: folder with spectra.npy or pictures, gateway_rssi.csv, or downlink.npy of the test rows, in the
            order of their index file.
        dataset: folder that bisplat benchmark made.
        benchmark: name of the benchmark: a dataset and a task, such as lab-blocked or rssi-office-random-200.
        method: name of the method (default: that of the folder).
        output: JSON file that gets the scores. It keeps those of the method on other benchmarks.
        force: replace scores on the same benchmark.
        json: print the scores as JSON.
    """
    from learn.benchmark.method_results import add_result, require_room
    from learn.benchmark.score_predictions import score_predictions

    called = predictions.resolve().name if method is None else method
    if not (called.strip() and called.isprintable()):
        raise ParameterError("method", f"expected a name of printable characters, found {called!r}")
    if output is None:
        refuse_given(["--method", "--force", "--no-force"], "-o beside it, found none")
    else:
        require_room(output, called, benchmark, force)
        require_writable(output)
    scores = score_predictions(predictions, dataset, benchmark)
    if output is not None:
        add_result(output, called, benchmark, scores, force)
    shown = {key: value for key, value in scores.items() if value is not None and key != "predictions_sha256"}
    if json:
        print(json_format.dumps(shown, indent=2))
    else:
        print_table(benchmark, {called: shown})
