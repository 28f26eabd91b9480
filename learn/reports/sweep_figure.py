"""The figure of a sweep: a score of each method against the number of training samples."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from learn.comparison.averages import average_name, spread_of
from learn.reports.method_styles import DOUBTFUL, line_styles
from learn.reports.paper import COLUMN, at_paper_size, save
from learn.reports.provenance import Provenance
from scenes.files.plain_text import in_figure

ROOM = 0.1  # Share of the axis that the label of a tick takes


@at_paper_size()
def draw_sweep(
    averages: Sequence[Mapping[str, Any]],
    key: str,
    axes: tuple[str, str],
    path: Path,
    made: Provenance,
    doubts: Collection[str] = (),
    note: str = "",
) -> None:
    """Draw a score against the number of training samples. Of several seeds, the bars are standard deviations."""
    figure = Figure(figsize=(COLUMN, 2.9), layout="constrained")
    axis = figure.subplots()
    averages = [row for row in averages if row["train_size"] is not None]
    stated = [row for row in averages if row.get(key) is not None]
    styles = line_styles(row["label"] for row in stated)
    for label in dict.fromkeys(row["label"] for row in stated):
        rows = sorted((row for row in stated if row["label"] == label), key=lambda row: row["train_size"])
        spreads = [row.get(spread_of(key), np.nan) for row in rows]  # nan draws no bar
        marked = f"{label}{DOUBTFUL}" if any(average_name(row) in doubts for row in rows) else label
        bars = spreads if np.isfinite(spreads).any() else None
        points = [row["train_size"] for row in rows], [row[key] for row in rows]
        axis.errorbar(*points, yerr=bars, capsize=2, label=in_figure(marked), **styles[label])
    axis.set(xscale="log", xlabel=axes[0], ylabel=axes[1])
    sizes = sorted({row["train_size"] for row in averages})
    if len(sizes) == 1:  # an axis of two decades around one point would promise a curve
        axis.set_xlim(0.8 * sizes[0], 1.25 * sizes[0])
    labelled = with_room(sizes, np.ptp(np.log(axis.get_xlim())))
    axis.set_xticks(labelled, [f"{size:g}" for size in labelled])
    axis.set_xticks([size for size in sizes if size not in labelled], minor=True, labels=[])
    axis.grid(which="both", alpha=0.3)
    if stated:
        figure.legend(loc="outside upper center", ncols=2, handlelength=3.2)
    save(figure, path, made, note)


def with_room(sizes: Sequence[int], width: float) -> list[int]:
    """The sizes whose labels have room beside each other on a logarithmic axis."""
    chosen: list[int] = []
    for size in sizes:
        if not chosen or np.log(size / chosen[-1]) >= ROOM * width:
            chosen.append(size)
    return chosen


def over_seeds(averages: Sequence[Mapping[str, Any]]) -> str:
    """What the points and bars of a figure are, if there are several seeds."""
    return " (mean ± deviation over seeds)" if any(row["seeds"] > 1 for row in averages) else " (one seed)"
