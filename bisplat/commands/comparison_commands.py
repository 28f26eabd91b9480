"""The commands that compare methods: compare, ablate, sweep."""

from __future__ import annotations

import json as json_format
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from tyro.conf import Positional, arg

from bisplat.commands.simulate_command import Output
from learn.training.registry import DEFAULT_MODEL, MODELS
from scenes.files.errors import printable
from scenes.files.text_tables import print_rows

if TYPE_CHECKING:
    ModelName = str
else:
    ModelName = Literal[tuple(MODELS)]  # the choices of the command line

DatasetFolder = Annotated[Positional[Path], arg(help="NeRF² dataset folder.")]
Split = Annotated[
    Literal["files", "random", "blocked"],
    arg(help="how the test part is chosen, as for train; random draws the same test part for every method."),
]
Budget = Annotated[float, arg(help="training time of each model that is trained by steps, minutes.")]
Seeds = Annotated[int, arg(help="number of fits of each method, with seeds 0, 1, …")]
TestSpectra = Annotated[
    int | None, arg(help="largest number of test spectra to score, evenly spread (default: all of the test part).")
]
Json = Annotated[bool, arg(help="print the table as JSON.")]


def compare(
    dataset: DatasetFolder,
    output: Output,
    models: tuple[str, ...] = (),
    split: Split = "files",
    budget: Budget = 5.0,
    seeds: Seeds = 1,
    test_spectra: TestSpectra = None,
    json: Json = False,
) -> None:
    """Score models and baselines on one split. The same command again adds missing rows and redraws the figures.

    Args:
        output: folder for table.html, ssim_cdf.png, results.jsonl, per_sample/ and the runs.
        models: names of models and baselines (docs/compare.md lists them), or module:Class of your own (default: all).
    """
    from learn.comparison.compare import compare as compare_methods
    from learn.reports.comparison_report import write_comparison

    comparison = compare_methods(dataset, models or None, split, budget, seeds, test_spectra, output)
    write_comparison(comparison, output)
    print_averages("comparison", comparison.table(), json, comparison.remark())
    print(printable(f"table: {output / 'table.html'}"), file=sys.stderr)


def ablate(
    dataset: DatasetFolder,
    output: Output,
    models: tuple[ModelName, ...] = ("bisplat", "bisplat-aperture"),
    split: Split = "files",
    steps: int = 1000,
    seeds: Seeds = 3,
    test_spectra: TestSpectra = None,
    primitives: int | None = None,
    json: Json = False,
) -> None:
    """Score models with one part at a time switched off. The same command again continues where it stopped.

    Args:
        output: folder for ablation.png, learning_curves.png, results.jsonl, per_sample/ and the runs.
        models: models whose parts are switched off.
        steps: number of training steps of each row and seed.
        primitives: number of primitives in every row; the table then has only the paper's rows (default: the models'
            own numbers).
    """
    from learn.comparison.ablate import ablate as ablate_models
    from learn.reports.comparison_report import write_ablation

    comparison = ablate_models(dataset, models, split, steps, seeds, test_spectra, primitives, output)
    write_ablation(comparison, output)
    print_averages("ablation", comparison.averages(), json)


def sweep(
    dataset: DatasetFolder,
    output: Output,
    sizes: tuple[int, ...],
    models: tuple[str, ...] = (DEFAULT_MODEL, "bisplat-aperture", "bisplat", "inverse-distance"),
    split: Split = "files",
    budget: Budget = 5.0,
    seeds: Seeds = 1,
    test_spectra: TestSpectra = None,
    init: Path | None = None,
    json: Json = False,
) -> None:
    """Score methods against the number of training spectra. The same command again continues where it stopped.

    Args:
        output: folder for sweep.png, results.jsonl, per_sample/ and the runs.
        sizes: numbers of training spectra; the validation part shrinks in proportion.
        models: as for compare.
        init: finished run, for example of a simulated dataset; its model is also trained starting from its weights.
    """
    from learn.comparison.sweep import sweep as sweep_sizes
    from learn.reports.comparison_report import write_sweep

    comparison = sweep_sizes(dataset, sizes, models, split, budget, seeds, test_spectra, init, output)
    write_sweep(comparison, output)
    print_averages("sweep", comparison.averages(), json, comparison.remark())


def print_averages(title: str, averages: Sequence[dict[str, Any]], json: bool, remark: str | None = None) -> None:
    """Print averages over the seeds.

    Args:
        title: title of the table.
        averages: rows of ``Comparison.averages``.
        json: print a JSON object, with the rows by their names, instead of a table.
        remark: sentence to print below the table, or on stderr beside JSON.
    """
    from learn.comparison.table import average_name, table_cells

    if json:
        figures = [{key: row[key] for key in row if key != "label" and row[key] is not None} for row in averages]
        named = {average_name(row): each for row, each in zip(averages, figures, strict=True)}
        print(json_format.dumps(named, indent=2))
    else:
        headings, *lines = table_cells(averages)
        print_rows(title, [dict(zip(headings, line, strict=True)) for line in lines])
    if remark is not None:
        print(printable(f"bisplat: {remark}"), file=sys.stderr if json else sys.stdout)
