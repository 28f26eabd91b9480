"""`bisplat compare`: every method and baseline on one split, under one metric code, in one table."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import torch

from learn.comparison.experiment import Experiment, Protocol, summary
from learn.comparison.methods import ON_A_CPU, method_named
from learn.reports.figures import draw_ssim_distribution
from learn.reports.pages import write_comparison
from learn.splits import SplitKind
from learn.training.run_folder import device_name
from simulate.dataset import read_dataset


def begin(
    dataset: Path, out: Path, split: SplitKind, minutes: float | None = None, steps: int | None = None
) -> Experiment:
    """The experiment of a folder, new or begun before."""
    protocol = Protocol(str(dataset.resolve()), split, 0, minutes, steps, device_name())
    return Experiment(out, read_dataset(dataset), protocol)


def compare(dataset: Path, out: Path, models: tuple[str, ...], split: SplitKind, minutes: float, seeds: int) -> Any:
    """Run what is missing, then draw; returns each method's figures, averaged over the seeds, best first.

    Args:
        dataset: folder.
        out: the experiment's folder; gets table.html, ssim_cdf.png, results.jsonl and per_sample/.
        models: names of methods, or module:Class.
        split: how the test part is chosen.
        minutes: of training, for each method that learns.
        seeds: how often each method is fitted.

    Raises:
        InputError: unknown method, bad dataset, or a folder of something else.
    """
    makers = {name: method_named(name) for name in models}
    experiment = begin(dataset, out, split, minutes)
    for name, make in makers.items():
        label = f"{name} (reduced)" if name in ON_A_CPU and not torch.cuda.is_available() else name
        for seed in range(seeds):
            experiment.run(label, make, seed)
    experiment.run_ceiling()

    rows = experiment.rows
    table = dict(sorted(summary(rows, lambda row: row["label"]).items(), key=lambda item: -item[1]["ssim_median"]))
    first = {row["label"]: experiment.per_sample(row)["ssim"] for row in reversed(rows)}
    draw_ssim_distribution({label: first[label] for label in table}, out / "ssim_cdf.png")
    write_comparison(experiment, table, out / "table.html")
    return table
