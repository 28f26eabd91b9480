"""The report of ``bisplat demo``: one page with the scene, the evaluation and the cross-validation."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from learn.evaluation.crossvalidate import CrossValidation
from learn.evaluation.evaluate import Evaluation
from learn.reports import crossvalidation_report, evaluation_report
from learn.reports.page import embedded, write_page


def write_demo(folder: Path, evaluation: Evaluation, fresh: CrossValidation, metrics: dict[str, Any]) -> None:
    """Write report.html.

    Args:
        folder: the demo's folder, with scene.png and the run in it; ``write_evaluation`` has written to
            ``run/evaluation`` and ``write_crossvalidation`` to ``run``.
        evaluation: scores on the test part of the demo's dataset.
        fresh: scores against fresh ray tracing.
        metrics: the content of the demo's metrics.json.
    """
    run = folder / "run"
    evaluated = evaluation_report.page_values(evaluation, run / "evaluation")
    crossvalidated = crossvalidation_report.page_values(fresh, run)
    figures = {**embedded(folder, ("scene",)), **evaluated["figures"], **crossvalidated["figures"]}
    values = {**evaluated, **crossvalidated, "figures": figures}
    write_page(folder / "report.html", "report.html.j2", metrics=metrics, **values)
