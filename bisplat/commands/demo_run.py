"""The demo: simulate spectra of the lab, train two models, score them, and write a report that grows meanwhile."""

from __future__ import annotations

import json
import os
import shlex
import shutil
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from learn.models.model_settings import PATIENCE, STEPS_MOST
from learn.reports.demo_report import DemoReport, draw_first_look, draw_first_spectra
from learn.training.registry import DEFAULT_MODEL
from scenes.drawing.scene_drawing import draw_scene
from scenes.files.atomic import write_atomically
from scenes.files.errors import printable, require_whole
from scenes.files.json_yaml_xml import read_json
from scenes.files.optional_packages import require_extra
from scenes.files.output_folder import own_folder
from scenes.files.schema import conform
from scenes.places.built_in import lab
from simulate.generation.simulation import simulate
from simulate.positions.placement import place
from simulate.positions.positions import MOST_POSITIONS

if TYPE_CHECKING:  # these load torch, and the first page must not wait for it
    from learn.evaluation.crossvalidate import CrossValidation
    from learn.evaluation.evaluate import Evaluation

BISPLAT_MODEL = "bisplat-aperture"  # The BiSplat model that the demo trains in addition to the default model
BISPLAT_STEPS = 1500  # Half of the model's own: on so few spectra its validation is best after a few hundred

SPECTRA_LEAST = 10  # Fewer leave too little to train on, to validate with and to test on

RECORD = "demo.json"  # Name of the file with the demo's settings

DATA_SEED, FRESH_SEED = 0, 1_000_000
FRESH_POSITIONS = 100


def demo(folder: Path, spectra: int = 1000, steps: int | None = None) -> dict[str, Any]:
    """Run the demo, or continue an interrupted one; the content of metrics.json."""
    require_whole(SPECTRA_LEAST, MOST_POSITIONS, spectra=spectra)
    if steps is not None:
        require_whole(1, STEPS_MOST, steps=steps)
    require_extra("rays", "the demo")
    settings = {"spectra": spectra, "steps": steps}

    def read(path: Path) -> dict[str, Any]:
        return conform(read_json(path, "the settings of a demo"), dict[str, Any], str(path))

    with own_folder(folder, "demo", RECORD, settings, read):
        write_atomically(folder / RECORD, (json.dumps(settings, indent=2) + "\n").encode())
        return _demo(folder, spectra, steps)


def _demo(folder: Path, spectra: int, steps: int | None) -> dict[str, Any]:
    began = time.monotonic()
    scene = lab()
    report = DemoReport(folder, scene, spectra)
    to_come = [
        f"the {spectra} spectra of the dataset",
        f"the accuracy of {DEFAULT_MODEL}, the default model",
        f"the accuracy of {BISPLAT_MODEL}, a model that is trained step by step",
        f"predictions against fresh ray tracing at {FRESH_POSITIONS} new positions",
    ]
    _say("1/5 drawing the lab, and a first look at six spectra")
    draw_scene(scene, folder / "scene.png")
    finished = (folder / "metrics.json").exists()  # by an earlier run, whose page is whole
    if not finished:
        report.write(["a first look at six spectra", *to_come])
        _say(f"open {report.path.resolve().as_uri()}: it grows as results come")
        if not (folder / "spectra.png").exists():
            draw_first_look(scene, place(scene, "uniform", spectra, DATA_SEED), DATA_SEED, folder)
            report.write(to_come)
            _say(f"the page shows six spectra, after {time.monotonic() - began:.0f} s")

    _say(f"2/5 tracing {spectra} spectra of the lab (first a search for all paths, which takes longest)")
    dataset = simulate(scene, folder / "dataset", spectra, seed=DATA_SEED)
    draw_first_spectra(dataset, folder)
    if not finished:
        report.write(to_come[1:])

    from learn.evaluation.crossvalidate import crossvalidate
    from learn.evaluation.evaluate import evaluate_spectra
    from learn.fitted.runs import train
    from learn.reports.evaluation_report import write_crossvalidation, write_evaluation

    evaluations: dict[str, Evaluation] = {}
    asked = {"steps": BISPLAT_STEPS, "patience": PATIENCE} if steps is None else {"steps": steps}
    own: dict[str, dict[str, Any]] = {DEFAULT_MODEL: {}, BISPLAT_MODEL: asked}
    for number, (model, name) in enumerate(((DEFAULT_MODEL, "run"), (BISPLAT_MODEL, "run-bisplat")), start=3):
        _say(f"{number}/5 training {model}")
        run = train(dataset, folder / name, model=model, seed=DATA_SEED, **own[model])
        _say(f"{number}/5 scoring {model} on held-out positions")
        evaluations[model] = evaluate_spectra(run, dataset)
        write_evaluation(evaluations[model], run.folder / "evaluation")
        if not finished:
            report.write(to_come[number - 1 :], evaluations)

    _say(f"5/5 tracing {FRESH_POSITIONS} new positions to test {DEFAULT_MODEL}")
    fresh = crossvalidate(folder / "run", scene, FRESH_POSITIONS, FRESH_SEED)
    write_crossvalidation(fresh, folder / "run")
    metrics = _metrics(evaluations[DEFAULT_MODEL], evaluations[BISPLAT_MODEL], fresh)
    seconds = round(time.monotonic() - began, 1)
    if finished:  # the time of the demo is that of the run that made it
        seconds = read_json(folder / "metrics.json", "the metrics of a demo").get("seconds", seconds)
    metrics |= {"spectra": spectra, "seconds": seconds}
    report.write((), evaluations, fresh, metrics)
    write_atomically(folder / "metrics.json", (json.dumps(metrics, indent=2) + "\n").encode())
    return metrics


def next_steps(folder: Path) -> str:
    """What the user can do after the demo: a few lines with commands."""
    activate = Path(sys.prefix) / "bin" / "activate"
    lines = [
        "What to do next:",
        f"  open the report         {(folder / 'report.html').resolve().as_uri()}",
        f"  move the transmitter    bisplat view {shlex.quote(str(folder / 'run'))}",
        "  use your own mesh       bisplat scene room.glb -o room ...   (bisplat scene --help)",
        "                          bisplat simulate room/scene.yaml -o data/room",
        "  use your measurements   bisplat train FOLDER -o runs/mine --split blocked",
    ]
    if shutil.which("bisplat") is None and activate.exists():  # make demo runs outside the environment
        lines.insert(1, f"  make bisplat a command  source {shlex.quote(os.path.relpath(activate))}")
    return "\n".join(map(printable, lines))


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
