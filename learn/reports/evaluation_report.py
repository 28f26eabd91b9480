"""The report of ``bisplat evaluate``: a page, its figures, the metrics as JSON, and scores of the spectra as CSV."""

from __future__ import annotations

import csv
import json
from io import StringIO
from pathlib import Path
from typing import Any

from learn.evaluation.evaluate import Evaluation
from learn.reports.figures import draw_examples, draw_examples_polar, draw_reliability, draw_ssim_distribution
from learn.reports.html_page import SCORE_COLUMNS, embedded, write_page
from scenes.files.atomic import write_atomically

FIGURES, RELIABILITY = ("ssim_cdf", "examples", "examples_polar"), "reliability"


def write_evaluation(evaluation: Evaluation, folder: Path) -> None:
    """Write report.html, metrics.json, per_sample.csv, and the figures as PNG and PDF.

    Args:
        evaluation: the result of ``evaluate``.
        folder: folder of the report, which is made if it does not exist.
    """
    folder.mkdir(parents=True, exist_ok=True)
    write_atomically(folder / "metrics.json", (json.dumps(evaluation.metrics(), indent=2) + "\n").encode())
    write_atomically(folder / "per_sample.csv", _per_sample(evaluation).encode())
    prediction, truth, ssim = evaluation.prediction, evaluation.truth, evaluation.scores["model"].ssim
    draw_ssim_distribution({name: scores.ssim for name, scores in evaluation.scores.items()}, folder / "ssim_cdf.png")
    draw_examples(prediction, truth, ssim, evaluation.dataset.grid, folder / "examples.png")
    draw_examples_polar(prediction, truth, ssim, evaluation.dataset.grid, folder / "examples_polar.png")
    if evaluation.errors_in_deviations is not None:
        draw_reliability(evaluation.errors_in_deviations, folder / f"{RELIABILITY}.png")
    write_page(folder / "report.html", "evaluation.html.j2", run=evaluation.run_name, **page_values(evaluation, folder))


def page_values(evaluation: Evaluation, folder: Path) -> dict[str, Any]:
    """Values that the template evaluation_part.html.j2 shows.

    Args:
        evaluation: the result of ``evaluate``.
        folder: folder in which ``write_evaluation`` has written the figures.
    """
    return {
        "rows": {name: scores.summary() for name, scores in evaluation.scores.items()},
        "columns": SCORE_COLUMNS,
        "dataset": evaluation.dataset,
        "test": len(evaluation.test),
        "figures": embedded(folder, FIGURES if evaluation.deviation is None else (*FIGURES, RELIABILITY)),
    }


def _per_sample(evaluation: Evaluation) -> str:
    """CSV with a row for each test spectrum: its name, position (metres) and scores."""
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["name", "x", "y", "z", "ssim", "psnr_db", "mae", "aoa_error_deg", "ssim_nearest", "deviation"])
    model, nearest = evaluation.scores["model"], evaluation.scores["nearest"]
    for row, index in enumerate(evaluation.test):
        position = evaluation.dataset.positions[index]
        scores = (model.ssim[row], model.psnr[row], model.mae[row], model.aoa_error[row], nearest.ssim[row])
        deviation = "" if evaluation.deviation is None else f"{evaluation.deviation[row]:.6f}"
        writer.writerow([evaluation.dataset.names[index], *position, *(f"{value:.6f}" for value in scores), deviation])
    return text.getvalue()
