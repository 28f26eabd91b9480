"""The tables and the figure of ``bisplat compare`` for received powers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from learn.evaluation.origin import split_words
from learn.powers.power_comparison import PowerComparison
from learn.reports.paper import COLUMN, at_paper_size, save
from learn.reports.plots import plot_cdf
from learn.reports.provenance import Provenance
from learn.reports.table_files import write_scores

SHOWN = 95
"""Percentile of the errors of the worst method at which the figure's axis ends."""


def write_power_comparison(comparison: PowerComparison, folder: Path) -> None:
    """Write results.json, table.tex, table.csv, and error_cdf.png (and .pdf): absolute errors of all gateways together.

    Args:
        comparison: the result of ``compare_powers``.
        folder: folder to write to; it must exist.
    """
    made = power_provenance(comparison)
    write_scores(comparison, folder, made)
    draw_errors(comparison, folder / "error_cdf.png", made)


def power_provenance(comparison: PowerComparison) -> Provenance:
    """Where the scores come from.

    Args:
        comparison: the result of ``compare_powers``.
    """
    name = comparison.folder.resolve().name
    return Provenance(
        title=f"Comparison of methods on {name}",
        model=", ".join(row["label"] for row in comparison),
        dataset=name,
        split=split_words(comparison.split, comparison.guard or None, comparison.seed),
        spectra=f"{comparison.known} known positions, {comparison.test} test positions",
        distances=comparison.distances.sentence(),
        seed=str(comparison.seed),
    )


@at_paper_size()
def draw_errors(comparison: PowerComparison, path: Path, made: Provenance) -> None:
    """Draw the distribution of the absolute error of each method, all gateways together.

    Args:
        comparison: the result of ``compare_powers``.
        path: path of the PNG; the PDF has the same name with the suffix .pdf.
        made: where the figure comes from.
    """
    errors = {row["label"]: comparison.errors[row["label"]] for row in comparison.table()}
    received = {label: each[~np.isnan(each)] for label, each in errors.items()}
    figure = Figure(figsize=(COLUMN, 3.2), layout="constrained")
    axis = figure.subplots()
    if all(each.size for each in received.values()):
        plot_cdf(received, axis, "absolute error (dB)")
        axis.set_xlim(0, max(float(np.percentile(each, SHOWN)) for each in received.values()) or 1)
        figure.legend(loc="outside upper center", ncols=2, handlelength=2.2, columnspacing=1)
    axis.set_ylabel("share of received powers")
    save(figure, path, made)
