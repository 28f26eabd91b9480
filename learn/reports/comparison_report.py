"""The figures and the page of ``bisplat compare``, ``ablate`` and ``sweep``."""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure

from learn.comparison.table import Comparison
from learn.reports.figures import draw_ssim_distribution, save
from learn.reports.html_page import SCORE_COLUMNS, embedded, write_page
from learn.reports.learning_curves import draw_learning_curves
from learn.reports.plots import label_log_axis
from scenes.files.plain_text import in_figure

COST_COLUMNS = {
    "parameters": "parameters",
    "training_seconds": "training (s)",
    "milliseconds_per_spectrum": "ms per spectrum",
}


def write_comparison(comparison: Comparison, folder: Path) -> None:
    """Write table.html with the averages over the seeds, and ssim_cdf.png (and .pdf) with the SSIM of the first seed.

    Args:
        comparison: the result of ``compare``.
        folder: folder to write to; it must exist.
    """
    rows = {row["label"]: row for row in comparison.table()}
    first_seed_rows = {row["label"]: row for row in reversed(comparison.rows)}
    ssim = {label: comparison.per_sample(first_seed_rows[label])["ssim"] for label in rows}
    draw_ssim_distribution(ssim, folder / "ssim_cdf.png")
    write_page(
        folder / "table.html",
        "compare.html.j2",
        settings=comparison.settings,
        test=max(row["test"] for row in comparison),
        rows=rows,
        columns={**SCORE_COLUMNS, **COST_COLUMNS},
        remark=comparison.remark(),
        figures=embedded(folder, ("ssim_cdf",)),
    )


def write_ablation(comparison: Comparison, folder: Path) -> None:
    """Write ablation.png and learning_curves.png (and both as .pdf).

    The former shows the median SSIM of every row: mean and standard deviation over the seeds.

    Args:
        comparison: the result of ``ablate``.
        folder: folder to write to; it must exist.
    """
    rows = comparison.averages()[::-1]
    figure = Figure(figsize=(7.5, 0.8 + 0.3 * len(rows)), layout="constrained")
    axis = figure.subplots()
    values, spreads = ([row[key] for row in rows] for key in ("ssim_median", "ssim_spread"))
    axis.errorbar(values, range(len(rows)), xerr=spreads, fmt="o", capsize=3)
    axis.set_yticks(range(len(rows)), [in_figure(row["label"]) for row in rows])
    axis.set_ylim(-0.5, len(rows) - 0.5)
    axis.locator_params(axis="x", nbins=6)
    figure.supxlabel("median SSIM (mean and standard deviation over seeds)", fontsize="medium")
    axis.grid(axis="x", alpha=0.3)
    save(figure, folder / "ablation.png")
    draw_learning_curves(comparison, folder / "learning_curves.png")


def write_sweep(comparison: Comparison, folder: Path) -> None:
    """Write sweep.png (and .pdf): median SSIM against the number of training spectra.

    The points are means over the seeds, and the bars are standard deviations.

    Args:
        comparison: the result of ``sweep``.
        folder: folder to write to; it must exist.
    """
    averages = comparison.averages()
    figure = Figure(figsize=(6.4, 4.2), layout="constrained")
    axis = figure.subplots()
    for label in dict.fromkeys(row["label"] for row in averages):
        rows = sorted((row for row in averages if row["label"] == label), key=lambda row: row["train_size"])
        sizes, values, spreads = ([row[key] for row in rows] for key in ("train_size", "ssim_median", "ssim_spread"))
        axis.errorbar(sizes, values, yerr=spreads, fmt="o-", capsize=3, label=in_figure(label))
    axis.set(xscale="log", xlabel="training spectra", ylabel="median SSIM on the same test part")
    label_log_axis(axis.xaxis)
    axis.grid(which="both", alpha=0.3)
    figure.legend(loc="outside upper center", ncols=2)
    save(figure, folder / "sweep.png")
