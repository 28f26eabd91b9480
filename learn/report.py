"""Self-contained HTML pages, of a demo and of a comparison: pictures inside, readable on a phone and in print."""

from __future__ import annotations

import base64
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, select_autoescape

from learn.crossvalidate import CrossValidation
from learn.evaluate import Evaluation
from learn.experiment import Experiment
from learn.figures import LABELS
from scenes.atomic import write_atomically

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

ENVIRONMENT = Environment(loader=PackageLoader("learn", "."), autoescape=select_autoescape(["j2"]))


def write_report(folder: Path, evaluation: Evaluation, fresh: CrossValidation, metrics: dict[str, Any]) -> None:
    """Write report.html from what ``evaluate`` and ``crossvalidate`` left in ``folder/run``.

    Args:
        folder: the demo's folder, with scene.png in it.
        evaluation: scores on held-out spectra.
        fresh: scores against fresh ray tracing.
        metrics: the demo's metrics.json.
    """
    run = folder / "run"
    figures = {
        "scene": folder / "scene.png",
        "examples": run / "evaluation" / "examples.png",
        "distribution": run / "evaluation" / "ssim_cdf.png",
        "map": run / "crossvalidation_map.png",
        "fresh_examples": run / "crossvalidation_examples.png",
    }
    rows = {LABELS[name]: scores.summary() for name, scores in evaluation.scores.items()}
    rows["model, against fresh ray tracing"] = fresh.scores.summary()
    page = ENVIRONMENT.get_template("report.html.j2").render(
        figures={name: base64.b64encode(path.read_bytes()).decode() for name, path in figures.items()},
        columns=COLUMNS,
        rows=rows,
        metrics=metrics,
        fresh_positions=len(fresh.positions),
        dataset=evaluation.dataset,
    )
    write_atomically(folder / "report.html", page.encode())


def write_comparison(experiment: Experiment, table: dict[str, dict[str, float]], path: Path) -> None:
    """Write the table of ``bisplat compare`` as a page.

    Args:
        experiment: its folder holds ssim_cdf.png.
        table: figures by method, best first.
        path: the page.
    """
    columns = {**COLUMNS, **COSTS}
    page = ENVIRONMENT.get_template("compare.html.j2").render(
        protocol=experiment.protocol,
        test=max(row["test"] for row in experiment.rows),
        table=table,
        columns=columns,
        columns_format={name: "%.0f" if name in ("parameters", "training_seconds") else "%.3f" for name in columns},
        distribution=base64.b64encode((experiment.folder / "ssim_cdf.png").read_bytes()).decode(),
    )
    write_atomically(path, page.encode())
