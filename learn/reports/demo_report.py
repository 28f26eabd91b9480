"""The report of ``bisplat demo``: one page with the scene, the scores of two models, and the cross-validation."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from learn.evaluation.crossvalidate import CrossValidation
from learn.evaluation.evaluate import Evaluation
from learn.reports import crossvalidation_report, evaluation_report
from learn.reports.figures import draw_ssim_distribution
from learn.reports.html_page import embedded, write_page


def write_demo(
    folder: Path, evaluations: Mapping[str, Evaluation], fresh: CrossValidation, metrics: dict[str, Any]
) -> None:
    """Write report.html and its figure of both models, ssim_cdf.png.

    Args:
        folder: the demo's folder. It contains scene.png and the first model's reports, which ``write_evaluation`` and
            ``write_crossvalidation`` have written to ``run/evaluation`` and ``run``.
        evaluations: evaluations on the same test spectra, by the models' names; the page shows examples of the first
            model.
        fresh: cross-validation of the first model.
        metrics: the content of the demo's metrics.json.
    """
    run = folder / "run"
    first = next(iter(evaluations.values()))
    scores = {f"model: {name}": evaluation.scores["model"] for name, evaluation in evaluations.items()}
    scores |= {name: baseline for name, baseline in first.scores.items() if name != "model"}
    draw_ssim_distribution({name: each.ssim for name, each in scores.items()}, folder / "ssim_cdf.png")
    evaluated = evaluation_report.page_values(first, run / "evaluation")
    evaluated["rows"] = {name: each.summary() for name, each in scores.items()}
    crossvalidated = crossvalidation_report.page_values(fresh, run)
    figures = {**evaluated["figures"], **crossvalidated["figures"], **embedded(folder, ("scene", "ssim_cdf"))}
    values = {**evaluated, **crossvalidated, "figures": figures, "models": list(evaluations)}
    write_page(folder / "report.html", "report.html.j2", metrics=metrics, **values)
