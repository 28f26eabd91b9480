"""The files of ``bisplat compare`` and ``sweep`` for received powers and for channels."""

from __future__ import annotations

from pathlib import Path

from learn.comparison.doubts import average_name, doubts_of, footnote_of
from learn.comparison.score_table import ScoreTable
from learn.reports.provenance import Provenance
from learn.reports.score_distribution import draw_score_distribution
from learn.reports.sweep_figure import draw_sweep, over_seeds
from learn.reports.table_files import write_scores

SHOWN = 95
"""Percentile of the errors of the worst method at which the axis of their distribution ends."""


def write_score_comparison(comparison: ScoreTable, folder: Path) -> None:
    """Write results.json, table.tex, table.csv, and error_cdf.png or snr_cdf.png (and .pdf), of the first seed."""
    made = Provenance.of_scores(comparison)
    write_scores(comparison, folder, made)
    draw_scores(comparison, folder, made)


def draw_scores(comparison: ScoreTable, folder: Path, made: Provenance) -> None:
    """Draw error_cdf.png or snr_cdf.png (and .pdf): how the scores of each method spread."""
    measure, of_each = comparison.MEASURE, comparison.of_each()
    scores = {average_name(row): of_each[average_name(row)] for row in comparison.table()}
    ends = SHOWN if measure.small_is_good else None
    draw_score_distribution(scores, measure.of_each, measure.share, folder / f"{measure.name}_cdf.png", made, ends)


def write_score_sweep(comparison: ScoreTable, folder: Path) -> None:
    """Write results.json, table.tex, table.csv, and sweep.png (and .pdf): the score against the number of samples."""
    made, averages = Provenance.of_scores(comparison), comparison.averages()
    write_scores(comparison, folder, made)
    measure = comparison.MEASURE
    axes = (f"training {comparison.THINGS}", f"median {measure.of_each}\n{over_seeds(averages).strip()}")
    figure = folder / "sweep.png"
    draw_sweep(averages, measure.key, axes, figure, made, doubts_of(averages), footnote_of(averages))
