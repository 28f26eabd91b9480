"""The tables and the figure of ``bisplat compare`` for channels over subcarriers (CSI)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from learn.channels.channel_comparison import ChannelComparison
from learn.evaluation.origin import split_words
from learn.reports.paper import COLUMN, at_paper_size, save
from learn.reports.plots import plot_cdf
from learn.reports.provenance import Provenance
from learn.reports.table_files import write_scores


def write_channel_comparison(comparison: ChannelComparison, folder: Path) -> None:
    """Write results.json, table.tex, table.csv, and snr_cdf.png (and .pdf): the SNR of the test rows.

    Args:
        comparison: the result of ``compare_channels``.
        folder: folder to write to; it must exist.
    """
    name = comparison.folder.resolve().name
    made = Provenance(
        title=f"Comparison of methods on {name}",
        model=", ".join(row["label"] for row in comparison),
        dataset=name,
        split=split_words(comparison.split, None, comparison.seed),
        spectra=f"{comparison.known} known rows, {comparison.test} test rows",
        seed=str(comparison.seed),
    )
    write_scores(comparison, folder, made)
    draw_ratios(comparison, folder / "snr_cdf.png", made)


@at_paper_size()
def draw_ratios(comparison: ChannelComparison, path: Path, made: Provenance) -> None:
    """Draw the distribution of the SNR of each method over the test rows.

    Args:
        comparison: the result of ``compare_channels``.
        path: path of the PNG; the PDF has the same name with the suffix .pdf.
        made: where the figure comes from.
    """
    ratios = {row["label"]: comparison.snr_db[row["label"]] for row in comparison.table()}
    stated = {label: each[~np.isnan(each)] for label, each in ratios.items()}
    figure = Figure(figsize=(COLUMN, 3.2), layout="constrained")
    axis = figure.subplots()
    if all(each.size for each in stated.values()):
        plot_cdf(stated, axis, "SNR of the predicted downlink (dB)")
        figure.legend(loc="outside upper center", ncols=2, handlelength=2.2, columnspacing=1)
    axis.set_ylabel("share of rows")
    save(figure, path, made)
