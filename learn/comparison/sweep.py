"""`bisplat sweep`: accuracy against the number of training spectra, always on the same test part."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from learn.comparison.compare import begin
from learn.comparison.experiment import summary
from learn.comparison.methods import Trained, method_named
from learn.reports.figures import save
from learn.splits import SplitKind
from learn.training.run_folder import load_run


def sweep(
    dataset: Path,
    out: Path,
    models: tuple[str, ...],
    sizes: tuple[int, ...],
    split: SplitKind,
    minutes: float,
    seeds: int,
    init: Path | None = None,
) -> Any:
    """Run what is missing, then draw sweep.png; returns the figures of each (method, size), averaged over the seeds.

    Args:
        dataset: folder.
        out: the experiment's folder.
        models: names of methods, or module:Class.
        sizes: spectra to train on; each smaller set is part of every larger one.
        split: how the test part is chosen.
        minutes: of training, for each method that learns.
        seeds: how often each is fitted.
        init: a finished run; its model is then also trained from its weights, as "MODEL from FOLDER".

    Raises:
        InputError: unknown method, bad run, bad dataset, fewer spectra than a size, or a folder of something else.
    """
    makers = {name: method_named(name) for name in models}
    if init is not None:
        model = load_run(init).config.model
        makers[f"{model} from {init.name}"] = partial(Trained, model, init=str(init.resolve()))
    experiment = begin(dataset, out, split, minutes)
    for seed in range(seeds):
        for size in sorted(sizes):
            for name, make in makers.items():
                experiment.run(name, make, seed, size)
    table = summary(experiment.rows, lambda row: (row["label"], row["train_size"]))
    draw(table, out / "sweep.png")
    return table


def draw(table: dict[tuple[str, int], dict[str, float]], path: Path) -> None:
    """Median SSIM against the number of training spectra, mean and spread over the seeds."""
    figure = Figure(figsize=(6.4, 4.2), layout="constrained")
    axis = figure.subplots()
    for label in dict.fromkeys(label for label, _ in table):
        sizes = sorted(size for name, size in table if name == label)
        rows = [table[label, size] for size in sizes]
        values, spreads = ([row[key] for row in rows] for key in ("ssim_median", "ssim_spread"))
        axis.errorbar(sizes, values, yerr=spreads, fmt="o-", capsize=3, label=label)
    axis.set(xscale="log", xlabel="training spectra", ylabel="median SSIM on the same test part")
    axis.grid(which="both", alpha=0.3)
    figure.legend(loc="outside upper center", ncols=2)
    save(figure, path)
