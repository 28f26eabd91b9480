"""The main job, end to end: lab -> simulate -> train -> evaluate -> cross-validate -> report."""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path
from typing import Any

from learn.evaluation.crossvalidate import crossvalidate
from learn.evaluation.evaluate import evaluate
from learn.reports.pages import write_report
from learn.training.run_folder import LEARNING_RATE, Config, ModelName
from learn.training.train import train
from scenes.atomic import write_atomically
from scenes.drawing import draw_scene
from scenes.lab import lab
from simulate.generate import generate
from simulate.placement import place
from simulate.propagation import Propagation
from simulate.request import Request

DATA_SEED, FRESH_SEED = 0, 1_000_000
FRESH_POSITIONS = 100
BATCH_SIZE = 8


def demo(folder: Path, spectra: int, steps: int) -> dict[str, Any]:
    """Run everything into a folder, going on where an interrupted demo stopped; returns metrics.json's content.

    Args:
        folder: gets dataset/, run/, report.html and metrics.json.
        spectra: spectra to simulate; a fifth of them is for testing.
        steps: optimiser steps.
    """
    began = time.monotonic()
    folder.mkdir(parents=True, exist_ok=True)
    scene = lab()
    _say(f"1/4 tracing {spectra} spectra of the lab")
    positions = place(scene, "uniform", spectra, DATA_SEED)
    request = Request(scene, positions, f"uniform, seed {DATA_SEED}", Propagation(), DATA_SEED)
    generate(request, folder / "dataset")

    _say("2/4 training bisplat-aperture")
    dataset = str((folder / "dataset").resolve())
    model: ModelName = "bisplat-aperture"
    config = Config(dataset, model, "files", DATA_SEED, DATA_SEED, steps, BATCH_SIZE, LEARNING_RATE[model])
    train(config, folder / "run")

    _say("3/4 evaluating on held-out positions")
    evaluation = evaluate(folder / "run")
    _say(f"4/4 tracing {FRESH_POSITIONS} fresh positions to cross-validate")
    fresh = crossvalidate(folder / "run", scene, FRESH_POSITIONS, FRESH_SEED)

    scores = evaluation.scores
    metrics = {
        "ssim_median": scores["model"].summary()["ssim_median"],
        "ssim_median_nearest": scores["nearest"].summary()["ssim_median"],
        "ssim_median_inverse_distance": scores["inverse_distance"].summary()["ssim_median"],
        "ssim_median_mean_picture": scores["mean_picture"].summary()["ssim_median"],
        "crossvalidation_ssim_median": fresh.metrics()["ssim_median"],
        "crossvalidation_aoa_error_median_deg": fresh.metrics()["aoa_error_median_deg"],
        "crossvalidation_channel_correlation_median": fresh.metrics().get("channel_correlation_median"),
        "aoa_error_median_deg": scores["model"].summary()["aoa_error_median_deg"],
        "spectra": spectra,
        "test_spectra": len(evaluation.test),
        "seconds": round(time.monotonic() - began, 1),
    }
    draw_scene(scene, folder / "scene.png")
    write_atomically(folder / "metrics.json", (json.dumps(metrics, indent=2) + "\n").encode())
    write_report(folder, evaluation, fresh, metrics)
    return metrics


def _say(sentence: str) -> None:
    print(f"bisplat demo: {sentence}", file=sys.stderr)
