"""The figures and the page of ``bisplat compare``, ``ablate`` and ``sweep``."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from learn.comparison.averaged_table import average_name, footnote_of
from learn.comparison.results_folder import run_folder
from learn.comparison.table import Comparison
from learn.reports.figures import draw_ssim_distribution
from learn.reports.html_page import SCORE_COLUMNS, embedded, write_page
from learn.reports.method_styles import DOUBTFUL, line_styles
from learn.reports.paper import COLUMN, PAGE, at_paper_size, save
from learn.reports.provenance import Provenance
from learn.reports.sweep_figure import draw_sweep, over_seeds
from learn.reports.table_files import marked_rows, write_tables
from scenes.files.plain_text import in_figure

COST_COLUMNS = {
    "parameters": "parameters",
    "training_seconds": "training (s)",
    "milliseconds_per_spectrum": "ms per spectrum",
}


def write_comparison(comparison: Comparison, folder: Path) -> None:
    """Write table.html, table.tex and table.csv of averages, and ssim_cdf.png (and .pdf) of the first seed."""
    rows = {average_name(row): row for row in comparison.table()}
    first_seed_rows = {average_name(row): row for row in reversed(comparison.rows)}
    ssim = {label: comparison.per_sample(first_seed_rows[label])["ssim"] for label in rows}
    doubts, made = comparison.doubts(), Provenance.of_comparison(comparison)
    marks = {label: f"{label}{DOUBTFUL}" if label in doubts else label for label in rows}
    curves, note = {marks[label]: values for label, values in ssim.items()}, footnote_of(comparison.averages())
    draw_ssim_distribution(curves, folder / "ssim_cdf.png", note, made)
    _write_tables(comparison, comparison.table(), folder)
    write_page(
        folder / "table.html",
        "compare.html.j2",
        made,
        settings=comparison.settings,
        test=max(row["test"] for row in comparison),
        rows={marks[label]: row for label, row in rows.items()},
        columns={**SCORE_COLUMNS, **COST_COLUMNS},
        seeds=max(row["seeds"] for row in rows.values()),
        remark=comparison.remark(),
        figures=embedded(folder, ("ssim_cdf",)),
    )


@at_paper_size()
def write_ablation(comparison: Comparison, folder: Path) -> None:
    """Write ablation.png (median SSIM of every row), learning_curves.png, table.tex and table.csv."""
    rows = comparison.averages()[::-1]
    figure = Figure(figsize=(PAGE, 0.6 + 0.2 * len(rows)), layout="constrained")
    axis = figure.subplots()
    styles = line_styles(row["label"] for row in rows)
    for place, row in enumerate(rows):
        style = {key: styles[row["label"]][key] for key in ("color", "marker") if key in styles[row["label"]]}
        axis.errorbar(
            row["ssim_median"], place, xerr=row.get("ssim_spread"), ls="", capsize=2, **{"marker": "o", **style}
        )
    marked = [name for row in rows for name in marked_rows([row], comparison.doubts())]
    axis.set_yticks(range(len(rows)), [in_figure(label) for label in marked])
    axis.set_ylim(-0.5, len(rows) - 0.5)
    axis.locator_params(axis="x", nbins=6)
    measure = f"median SSIM{over_seeds(rows)}"
    axis.set_xlabel(measure)
    axis.grid(axis="x", alpha=0.3)
    save(figure, folder / "ablation.png", Provenance.of_comparison(comparison), footnote_of(comparison.averages()))
    draw_learning_curves(comparison, folder / "learning_curves.png")
    _write_tables(comparison, rows[::-1], folder)


def write_sweep(comparison: Comparison, folder: Path) -> None:
    """Write sweep.png (and .pdf), median SSIM against the number of training spectra, table.tex and table.csv."""
    averages, doubts = comparison.averages(), comparison.doubts()
    made, note = Provenance.of_comparison(comparison), footnote_of(comparison.averages())
    axes = ("training spectra", f"median SSIM{over_seeds(averages)}")
    draw_sweep(averages, "ssim_median", axes, folder / "sweep.png", made, doubts, note)
    _write_tables(comparison, averages, folder)


def _write_tables(comparison: Comparison, averages: Sequence[Mapping[str, Any]], folder: Path) -> None:
    """Write table.tex and table.csv. Rows with doubts are marked."""
    rows, note = marked_rows(averages, comparison.doubts()), footnote_of(comparison.averages())
    write_tables(rows, {**SCORE_COLUMNS, **COST_COLUMNS}, folder, Provenance.of_comparison(comparison), note)


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
