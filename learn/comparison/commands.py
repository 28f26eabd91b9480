"""The commands of an experiment: compare, ablate, sweep."""

from __future__ import annotations

import json as json_format
import sys
from pathlib import Path
from typing import Literal

from tyro.conf import Positional

from learn.commands import positive
from scenes.text_tables import print_rows
from simulate.command import Output


def compare(
    dataset: Positional[Path],
    output: Output,
    models: tuple[str, ...] = (),
    split: Literal["files", "random", "blocked"] = "files",
    budget: float = 5.0,
    seeds: int = 1,
    json: bool = False,
) -> None:
    """Every model and baseline on one split, in one table. The same command again adds what is missing, and redraws.

    Args:
        dataset: NeRF² dataset folder.
        output: folder for table.html, ssim_cdf.png, results.jsonl, per_sample/ and the runs.
        models: which (default: all): mean-picture, nearest, inverse-distance, kriging, kriging-responses, mlp,
            mlp-responses, nerf2, swiftwrf, helmholtz, bisplat, bisplat-plus, bisplat-aperture, or module:Class of your
            own.
        split: as for train; random draws the same test part for every method.
        budget: minutes of training, for each method that learns.
        seeds: how often each method is fitted.
        json: print the table as JSON.
    """
    from learn.comparison.compare import compare as compare_methods
    from learn.comparison.methods import METHODS

    positive(budget=budget, seeds=seeds)
    print_figures("comparison", compare_methods(dataset, output, models or tuple(METHODS), split, budget, seeds), json)
    print(f"table: {output / 'table.html'}", file=sys.stderr)


def ablate(
    dataset: Positional[Path],
    output: Output,
    models: tuple[Literal["bisplat", "bisplat-plus", "bisplat-aperture"], ...] = ("bisplat", "bisplat-aperture"),
    split: Literal["files", "random", "blocked"] = "blocked",
    steps: int = 1000,
    seeds: int = 3,
    primitives: int | None = None,
    json: bool = False,
) -> None:
    """What each part of a model is worth: the paper's table over several seeds, and ours. Goes on where it stopped.

    Args:
        dataset: NeRF² dataset folder.
        output: folder for ablation.png, results.jsonl, per_sample/ and the runs.
        models: whose parts.
        split: as for train.
        steps: of training, for each row and seed.
        seeds: how often each row is trained.
        primitives: of every row, where not the models' own number; then the paper's rows alone, marked so.
        json: print the table as JSON.
    """
    from learn.comparison.ablate import ablate as ablate_models

    positive(steps=steps, seeds=seeds)
    print_figures("ablation", ablate_models(dataset, output, models, split, steps, seeds, primitives), json)


def sweep(
    dataset: Positional[Path],
    output: Output,
    sizes: tuple[int, ...],
    models: tuple[str, ...] = ("bisplat-aperture", "bisplat", "inverse-distance"),
    split: Literal["files", "random", "blocked"] = "files",
    budget: float = 5.0,
    seeds: int = 1,
    init: Path | None = None,
    json: bool = False,
) -> None:
    """Accuracy against the number of training spectra, on the same test part. Goes on where it stopped.

    Args:
        dataset: NeRF² dataset folder.
        output: folder for sweep.png, results.jsonl, per_sample/ and the runs.
        sizes: numbers of training spectra; baselines also have the validation part.
        models: as for compare.
        split: as for train.
        budget: minutes of training, for each method that learns.
        seeds: how often each is fitted.
        init: a finished run (of a simulated place, say) whose model is then also trained on from its weights.
        json: print the table as JSON.
    """
    from learn.comparison.sweep import sweep as sweep_sizes

    positive(budget=budget, seeds=seeds)
    table = sweep_sizes(dataset, output, models, sizes, split, budget, seeds, init)
    print_figures("sweep", {f"{label}, {size}": row for (label, size), row in table.items()}, json)


def print_figures(title: str, table: dict[str, dict[str, float]], json: bool) -> None:
    if json:
        print(json_format.dumps(table, indent=2))
        return
    shown = {
        "ssim_median": "SSIM",
        "ssim_spread": "± seeds",
        "ssim_p05": "5th %",
        "aoa_error_median_deg": "AoA (°)",
        "training_seconds": "train (s)",
        "milliseconds_per_spectrum": "ms each",
    }
    print_rows(
        title,
        [{"": name} | {short: row.get(key, "") for key, short in shown.items()} for name, row in table.items()],
    )
