"""The files of ``bisplat compare`` and ``sweep`` for received powers, channels and folders of rooms."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float
from matplotlib.figure import Figure

from learn.comparison.averaged_table import average_name, doubts_of, footnote_of
from learn.comparison.score_table import ScoreTable
from learn.reports.paper import COLUMN, at_paper_size, save
from learn.reports.plots import plot_cdf
from learn.reports.provenance import Provenance
from learn.reports.sweep_figure import draw_sweep, over_seeds
from learn.reports.table_files import write_scores
from learn.rooms.room_comparison import RoomComparison

SHOWN = 95  # Percentile of the errors of the worst method at which the axis of their distribution ends


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


@at_paper_size()
def draw_score_distribution(
    scores: Mapping[str, Float[np.ndarray, "..."]],
    label: str,
    share: str,
    path: Path,
    made: Provenance,
    percentile: float | None = None,
) -> None:
    """Draw the cumulative distribution of the scores of each method."""
    stated = {name: each[~np.isnan(each)] for name, each in scores.items()}
    figure = Figure(figsize=(COLUMN, 2.3 + 0.15 * len(stated)), layout="constrained")
    axis = figure.subplots()
    if all(each.size for each in stated.values()):
        plot_cdf(stated, axis, label)
        if percentile is not None:
            axis.set_xlim(0, max(float(np.percentile(each, percentile)) for each in stated.values()) or 1)
        figure.legend(loc="outside upper left", handlelength=3.2)
    axis.set_ylabel(share)
    save(figure, path, made)


def write_room_comparison(comparison: RoomComparison, folder: Path) -> None:
    """Write results.json, table.tex, table.csv, and rooms.png (and .pdf): mean SSIM over the number of spectra."""
    averages = comparison.averages()
    made = _provenance(comparison)
    write_scores(comparison, folder, made)
    axes = ("known spectra in a test room", f"mean SSIM\n{over_seeds(averages).strip()}")
    figure = folder / "rooms.png"
    draw_sweep(averages, "ssim_mean", axes, figure, made, doubts_of(averages), footnote_of(averages))


def _provenance(comparison: RoomComparison) -> Provenance:
    name = comparison.folder.resolve().name
    seeds = max(row["seed"] for row in comparison) + 1
    spectra = next(row["spectra"] for row in comparison)
    return Provenance(
        title=f"Comparison of methods in the rooms of {name}",
        model=", ".join(dict.fromkeys(row["label"] for row in comparison)),
        dataset=name,
        split=f"setting {comparison.setting}",
        spectra=f"{_rooms(comparison.training, 'training')}, {_rooms(comparison.test, 'test')}, {spectra} test spectra",
        distances="the known spectra of a test room are drawn at random",
        seed="0" if seeds == 1 else f"0 to {seeds - 1}",
    )


def _rooms(names: Sequence[str], kind: str) -> str:
    return f"1 {kind} room" if len(names) == 1 else f"{len(names)} {kind} rooms"
