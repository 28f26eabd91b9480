"""The demo: simulate spectra of the lab, train two models, evaluate and cross-validate them, and write a report."""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path
from typing import Any

from msgspec import Struct

from learn.evaluation.crossvalidate import CrossValidation, crossvalidate
from learn.evaluation.evaluate import Evaluation, evaluate
from learn.models.steps import STEPS_MOST
from learn.reports.crossvalidation_report import write_crossvalidation
from learn.reports.demo_report import write_demo
from learn.reports.evaluation_report import write_evaluation
from learn.training.registry import DEFAULT_MODEL
from learn.training.train import train
from scenes.drawing.scene_drawing import draw_scene
from scenes.files.atomic import write_atomically
from scenes.files.errors import printable, require_whole
from scenes.files.extras import require_extra
from scenes.files.json_file import read_json
from scenes.files.output_folder import own_folder
from scenes.files.schema import conform
from scenes.places.lab import lab
from simulate.generation.simulation import simulate
from simulate.positions.given_positions import MOST_POSITIONS

BISPLAT_MODEL = "bisplat-aperture"
"""The BiSplat model that the demo trains in addition to the default model."""

SPECTRA_LEAST = 10
"""Fewer leave too little to train on, to validate with and to test on."""

RECORD = "demo.json"
"""Name of the file with the demo's settings."""

DATA_SEED, FRESH_SEED = 0, 1_000_000
FRESH_POSITIONS = 100


def demo(folder: Path, spectra: int = 1000, steps: int | None = None) -> dict[str, Any]:
    """Run the demo, or continue an interrupted one.

    Args:
        folder: output folder of dataset/, run/ (the default model), run-bisplat/, report.html and metrics.json.
        spectra: number of spectra to simulate; a fifth of them is for testing.
        steps: number of optimiser steps of the BiSplat model; None: its own.

    Returns:
        The content of metrics.json; a score whose name has no model is the default model's.

    Raises:
        ParameterError: fewer than ``SPECTRA_LEAST`` spectra, no steps, or absurdly many of either.
        MissingExtraError: the ray tracer is not installed.
        InputError: the folder holds other files, or a demo with other settings, or another process writes to it.
    """
    require_whole(SPECTRA_LEAST, MOST_POSITIONS, spectra=spectra)
    if steps is not None:
        require_whole(1, STEPS_MOST, steps=steps)
    require_extra("rays", "the demo")
    settings = {"spectra": spectra, "steps": steps}
    with own_folder(folder, "demo", RECORD, settings, _read_settings):
        write_atomically(folder / RECORD, (json.dumps(settings, indent=2) + "\n").encode())
        return _demo(folder, spectra, steps)


class Settings(Struct, frozen=True, forbid_unknown_fields=True):
    """The file ``RECORD``."""

    spectra: int
    steps: int | None


def _read_settings(path: Path) -> dict[str, Any]:
    content = read_json(path, "the settings of a demo")
    conform(content, Settings, str(path))
    return content


def _demo(folder: Path, spectra: int, steps: int | None) -> dict[str, Any]:
    """Run the demo in a folder that holds its settings."""
    began = time.monotonic()
    scene = lab()
    _say(f"1/5 tracing {spectra} spectra of the lab")
    dataset = simulate(scene, folder / "dataset", spectra, seed=DATA_SEED)

    _say(f"2/5 fitting {DEFAULT_MODEL}, the default model")
    run = train(dataset, folder / "run", seed=DATA_SEED)
    _say(f"3/5 training {BISPLAT_MODEL}")
    bisplat_run = train(dataset, folder / "run-bisplat", model=BISPLAT_MODEL, seed=DATA_SEED, steps=steps)

    _say("4/5 evaluating both on held-out positions")
    evaluation, bisplat_evaluation = evaluate(run, dataset), evaluate(bisplat_run, dataset)
    write_evaluation(evaluation, run.folder / "evaluation")
    write_evaluation(bisplat_evaluation, bisplat_run.folder / "evaluation")
    _say(f"5/5 tracing {FRESH_POSITIONS} fresh positions to cross-validate {DEFAULT_MODEL}")
    fresh = crossvalidate(run, scene, FRESH_POSITIONS, FRESH_SEED)
    write_crossvalidation(fresh, run.folder)

    metrics = _metrics(evaluation, bisplat_evaluation, fresh)
    metrics |= {"spectra": spectra, "seconds": round(time.monotonic() - began, 1)}
    draw_scene(scene, folder / "scene.png")
    write_atomically(folder / "metrics.json", (json.dumps(metrics, indent=2) + "\n").encode())
    write_demo(folder, {DEFAULT_MODEL: evaluation, BISPLAT_MODEL: bisplat_evaluation}, fresh, metrics)
    return metrics


def _metrics(evaluation: Evaluation, bisplat: Evaluation, fresh: CrossValidation) -> dict[str, Any]:
    scores = {name: each.summary() for name, each in evaluation.scores.items()}
    crossvalidated = fresh.metrics()
    return {
        "ssim_median": scores["model"]["ssim_median"],
        "ssim_median_bisplat": bisplat.scores["model"].summary()["ssim_median"],
        "ssim_median_nearest": scores["nearest"]["ssim_median"],
        "ssim_median_inverse_distance": scores["inverse-distance"]["ssim_median"],
        "ssim_median_mean_picture": scores["mean-picture"]["ssim_median"],
        "crossvalidation_ssim_median": crossvalidated["ssim_median"],
        "crossvalidation_aoa_error_median_deg": crossvalidated["aoa_error_median_deg"],
        "crossvalidation_channel_correlation_median": crossvalidated.get("channel_correlation_median"),
        "aoa_error_median_deg": scores["model"]["aoa_error_median_deg"],
        "test_spectra": len(evaluation.test),
    }


def _say(sentence: str) -> None:
    print(printable(f"bisplat demo: {sentence}"), file=sys.stderr)
