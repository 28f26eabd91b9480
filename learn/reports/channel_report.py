"""The tables and the figure of ``bisplat compare`` for channels over subcarriers (CSI)."""

from __future__ import annotations

from pathlib import Path

from learn.channels.channel_comparison import ChannelComparison
from learn.evaluation.origin import split_words
from learn.reports.provenance import Provenance
from learn.reports.score_distribution import draw_score_distribution
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
    ratios = {row["label"]: comparison.snr_db[row["label"]] for row in comparison.table()}
    label = "SNR of the predicted downlink (dB)"
    draw_score_distribution(ratios, label, "share of rows", folder / "snr_cdf.png", made)
