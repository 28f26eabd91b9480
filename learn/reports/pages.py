"""Self-contained HTML pages in one look: pictures inside, light and dark, readable on a phone and in print."""

from __future__ import annotations

import base64
from pathlib import Path
from typing import TYPE_CHECKING, Any

from jinja2 import Environment, PackageLoader, StrictUndefined, select_autoescape

from learn.reports.figures import LABELS
from scenes.atomic import write_atomically

if TYPE_CHECKING:  # they write their pages here
    from learn.comparison.experiment import Experiment
    from learn.evaluation.crossvalidate import CrossValidation
    from learn.evaluation.evaluate import Evaluation

COLUMNS = {
    "ssim_median": "SSIM median",
    "ssim_mean": "SSIM mean",
    "ssim_p05": "SSIM 5th percentile",
    "psnr_mean": "PSNR (dB)",
    "mae_mean": "mean abs. error",
    "aoa_error_median_deg": "AoA error (°)",
}

COSTS = {
    "parameters": "parameters",
    "training_seconds": "training (s)",
    "milliseconds_per_spectrum": "ms per spectrum",
}

EVALUATION_FIGURES = ("ssim_cdf", "examples", "examples_polar")
CROSSVALIDATION_FIGURES = (
    "crossvalidation_map",
    "crossvalidation_distance",
    "crossvalidation_examples",
    "crossvalidation_polar",
)

ENVIRONMENT = Environment(
    loader=PackageLoader("learn.reports"), autoescape=select_autoescape(["j2"]), undefined=StrictUndefined
)


def write_evaluation(evaluation: Evaluation, run: str, folder: Path) -> None:
    """Write report.html of ``bisplat evaluate``.

    Args:
        evaluation: scores on held-out spectra.
        run: its name.
        folder: where the figures are and the page will be.
    """
    _write(folder / "report.html", "evaluation.html.j2", run=run, **_evaluated(evaluation, folder))


def write_crossvalidation(fresh: CrossValidation, scene: str, folder: Path) -> None:
    """Write crossvalidation.html of ``bisplat crossvalidate``.

    Args:
        fresh: scores against fresh ray tracing.
        scene: its name.
        folder: the run's, where the figures are and the page will be.
    """
    values = _crossvalidated(fresh, folder)
    _write(folder / "crossvalidation.html", "crossvalidation.html.j2", run=folder.name, scene=scene, **values)


def write_report(folder: Path, evaluation: Evaluation, fresh: CrossValidation, metrics: dict[str, Any]) -> None:
    """Write report.html of ``bisplat demo`` from what ``evaluate`` and ``crossvalidate`` left in ``folder/run``.

    Args:
        folder: the demo's folder, with scene.png in it.
        evaluation: scores on held-out spectra.
        fresh: scores against fresh ray tracing.
        metrics: the demo's metrics.json.
    """
    run = folder / "run"
    evaluated, crossvalidated = _evaluated(evaluation, run / "evaluation"), _crossvalidated(fresh, run)
    figures = {**_figures(folder, ("scene",)), **evaluated["figures"], **crossvalidated["figures"]}
    values = {**evaluated, **crossvalidated, "figures": figures}
    _write(folder / "report.html", "report.html.j2", metrics=metrics, **values)


def write_comparison(experiment: Experiment, table: dict[str, dict[str, float]], path: Path) -> None:
    """Write the table of ``bisplat compare`` as a page.

    Args:
        experiment: its folder holds ssim_cdf.png.
        table: figures by method, best first.
        path: the page.
    """
    _write(
        path,
        "compare.html.j2",
        protocol=experiment.protocol,
        test=max(row["test"] for row in experiment.rows),
        rows=table,
        columns={**COLUMNS, **COSTS},
        figures=_figures(experiment.folder, ("ssim_cdf",)),
    )


def _evaluated(evaluation: Evaluation, folder: Path) -> dict[str, Any]:
    return {
        "rows": {LABELS[name]: scores.summary() for name, scores in evaluation.scores.items()},
        "columns": COLUMNS,
        "dataset": evaluation.dataset,
        "test": len(evaluation.test),
        "figures": _figures(folder, EVALUATION_FIGURES),
    }


def _crossvalidated(fresh: CrossValidation, folder: Path) -> dict[str, Any]:
    return {
        "fresh_rows": {"model, against fresh ray tracing": fresh.scores.summary()},
        "columns": COLUMNS,
        "fresh": fresh.metrics(),
        "figures": _figures(folder, CROSSVALIDATION_FIGURES),
    }


def _figures(folder: Path, names: tuple[str, ...]) -> dict[str, str]:
    return {name: base64.b64encode((folder / f"{name}.png").read_bytes()).decode() for name in names}


def _write(path: Path, template: str, **values: Any) -> None:
    write_atomically(path, ENVIRONMENT.get_template(template).render(**values).encode())
