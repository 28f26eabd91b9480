"""`bisplat ablate`: what each part of a model is worth, over several seeds."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Literal

from matplotlib.figure import Figure

from learn.comparison.compare import begin
from learn.comparison.experiment import summary
from learn.comparison.methods import Trained
from learn.reports.figures import save
from learn.splits import SplitKind

Ablated = Literal["bisplat", "bisplat-plus", "bisplat-aperture"]

OURS: dict[str, dict[str, int]] = {
    "TX-PE order 2": {"tx_order": 2},
    "TX-PE order 4": {"tx_order": 4},
    "TX-PE order 6": {"tx_order": 6},
    "125 primitives": {"primitives": 125},
    "1000 primitives": {"primitives": 1000},
    "16 clusters": {"clusters": 16},
    "144 clusters": {"clusters": 144},
}
"""Sizes of bisplat-aperture that its table has beside the paper's rows."""


def variants(model: Ablated, primitives: int | None = None) -> Iterator[tuple[str, Trained]]:
    """Rows of a model's table: the paper's, then those that only ours has, all at the same number of primitives.

    Args:
        model: whose table.
        primitives: where not the model's own number; the labels say so.
    """
    label, size = (
        (model, {}) if primitives is None else (f"{model} ({primitives} primitives)", {"primitives": primitives})
    )
    yield label, Trained(model, size=size)
    yield f"{label} without dynamic network", Trained(model, ("dynamic",), size)
    yield f"{label} without delta decoder", Trained(model, ("delta",), size)
    yield f"{label} without BST", Trained(model, ("bst",), size)
    if model == "bisplat-aperture" and primitives is None:
        yield f"{model} without aperture", Trained("bisplat", size={"tx_order": 3})
        yield f"{model} without depth order", Trained(model, ("order",))
        for name, size in OURS.items():
            yield f"{model}, {name}", Trained(model, size=size)


def ablate(
    dataset: Path,
    out: Path,
    models: tuple[Ablated, ...],
    split: SplitKind,
    steps: int,
    seeds: int,
    primitives: int | None = None,
) -> Any:
    """Run what is missing, then draw ablation.png; returns each variant's figures, averaged over the seeds.

    Args:
        dataset: folder.
        out: the experiment's folder.
        models: which tables.
        split: how the test part is chosen.
        steps: of training, for each row and seed: the same, so that the parts differ and the training does not.
        seeds: how often each row is trained.
        primitives: where not the models' own number, which takes long without a GPU; then the paper's rows alone.

    Raises:
        InputError: bad dataset, or a folder of something else.
    """
    experiment = begin(dataset, out, split, steps=steps)
    rows = [row for model in models for row in variants(model, primitives)]
    for seed in range(seeds):  # all rows once, then again: a table that is interrupted is a table of fewer seeds
        for label, method in rows:
            experiment.run(label, partial(replace, method), seed)
    table = summary(experiment.rows, lambda row: row["label"])
    draw(table, out / "ablation.png")
    return table


def draw(table: dict[str, dict[str, float]], path: Path) -> None:
    """Median SSIM of every row, mean and spread over the seeds."""
    figure = Figure(figsize=(7.5, 0.8 + 0.3 * len(table)), layout="constrained")
    axis = figure.subplots()
    names = list(table)[::-1]
    values, spreads = ([table[name][key] for name in names] for key in ("ssim_median", "ssim_spread"))
    axis.errorbar(values, range(len(names)), xerr=spreads, fmt="o", capsize=3)
    axis.set_yticks(range(len(names)), names)
    figure.supxlabel("median SSIM, mean and standard deviation over seeds", fontsize="medium")
    axis.grid(axis="x", alpha=0.3)
    save(figure, path)
