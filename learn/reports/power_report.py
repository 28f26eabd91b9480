"""The tables and the figure of ``bisplat compare`` for received powers."""

from __future__ import annotations

from pathlib import Path

from learn.evaluation.origin import split_words
from learn.powers.power_comparison import PowerComparison
from learn.reports.provenance import Provenance
from learn.reports.score_distribution import draw_score_distribution
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
    errors = {row["label"]: comparison.errors[row["label"]] for row in comparison.table()}
    share = "share of received powers"
    draw_score_distribution(errors, "absolute error (dB)", share, folder / "error_cdf.png", made, SHOWN)


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
