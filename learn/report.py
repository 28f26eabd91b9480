"""A self-contained HTML page of a demo: pictures inside the file, readable on a phone and in print."""

from __future__ import annotations

import base64
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, select_autoescape

from learn.crossvalidate import CrossValidation
from learn.evaluate import Evaluation
from learn.figures import LABELS
from scenes.atomic import write_atomically

COLUMNS = {
    "ssim_median": "SSIM median",
    "ssim_p05": "SSIM 5th percentile",
    "psnr_mean": "PSNR (dB)",
    "mae_mean": "mean abs. error",
    "aoa_error_median_deg": "AoA error (°)",
}


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
    environment = Environment(loader=PackageLoader("learn", "."), autoescape=select_autoescape(["j2"]))
    page = environment.get_template("report.html.j2").render(
        figures={name: base64.b64encode(path.read_bytes()).decode() for name, path in figures.items()},
        columns=COLUMNS,
        rows=rows,
        metrics=metrics,
        fresh_positions=len(fresh.positions),
        dataset=evaluation.dataset,
    )
    write_atomically(folder / "report.html", page.encode())
