"""Learning curves of the models of a comparison: the validation SSIM against the number of steps."""

from __future__ import annotations

import csv
from pathlib import Path

from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from learn.comparison.kept_rows import run_folder
from learn.comparison.table import Comparison
from learn.reports.method_styles import line_styles
from learn.reports.paper import COLUMN, at_paper_size, save
from learn.reports.provenance import Provenance
from scenes.files.plain_text import in_figure


def validation_curve(run: Path) -> tuple[list[int], list[float]]:
    """Steps and validation SSIMs that a training logged, over all its interruptions; empty if it was not by steps."""
    found: dict[int, float] = {}
    for log in sorted(run.glob("logs/version_*/metrics.csv"), key=lambda path: int(path.parent.name.split("_")[1])):
        with log.open(newline="") as file:
            found |= {
                int(row["step"]) + 1: float(row["validation_ssim"])
                for row in csv.DictReader(file)
                if row.get("validation_ssim")
            }
    steps = sorted(found)
    return steps, [found[step] for step in steps]


@at_paper_size()
def draw_learning_curves(comparison: Comparison, path: Path) -> None:
    """Draw the learning curve of every row that was trained by steps, each method in a colour."""
    styles = line_styles(row["label"] for row in comparison.rows)
    figure = Figure(figsize=(COLUMN, 2.3 + 0.15 * len(styles)), layout="constrained")
    axis = figure.subplots()
    for row in comparison.rows:
        steps, ssim = validation_curve(comparison.folder / run_folder(row))
        if steps:
            label = in_figure(row["label"]) if row["seed"] == 0 else ""
            axis.plot(steps, ssim, label=label, **styles[row["label"]])
    axis.set(xlabel="training steps", ylabel="median SSIM, validation part")
    axis.xaxis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))
    axis.grid(alpha=0.3)
    figure.legend(loc="outside upper left", handlelength=3.2)
    save(figure, path, Provenance.of_comparison(comparison))
