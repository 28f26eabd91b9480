"""Evaluate a run on held-out spectra, beside the baselines and the array's ceiling on the same split."""

from __future__ import annotations

import csv
import json
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from learn.baselines.array_ceiling import SAMPLES, array_ceiling
from learn.baselines.neighbours import inverse_distance, mean_picture, nearest
from learn.metrics import Scores, score
from learn.reports.figures import draw_examples, draw_examples_polar, draw_ssim_distribution
from learn.reports.pages import write_evaluation
from learn.splits import evenly
from learn.training.run_folder import load_run
from scenes.atomic import write_atomically
from scenes.errors import InputError
from simulate.dataset import Dataset, read_dataset, read_index


@dataclass(frozen=True)
class Evaluation:
    """Predictions on a test part and the scores of everything that was compared.

    Attributes:
        dataset: what was evaluated on.
        test: indices of the test spectra.
        prediction: the model's pictures.
        scores: by name: "model", "mean_picture", "nearest", "inverse_distance", "array_ceiling" (on fewer spectra).
    """

    dataset: Dataset
    test: Int[np.ndarray, " K"]
    prediction: Float[np.ndarray, "K 90 360"]
    scores: dict[str, Scores]

    def metrics(self) -> dict[str, Any]:
        """The figures of ``bisplat evaluate --json``."""
        baselines = {name: scores.summary() for name, scores in self.scores.items() if name != "model"}
        return {**self.scores["model"].summary(), "test_spectra": len(self.test), "baselines": baselines}


def evaluate(folder: Path, dataset_folder: Path | None = None, index: Path | None = None) -> Evaluation:
    """Evaluate a run and write to its ``evaluation``: report.html, metrics.json, per_sample.csv, figures.

    Args:
        folder: the run.
        dataset_folder: another dataset, tested on all of its spectra that the run was not trained on, or on ``index``;
            None: the test part of the dataset trained on.
        index: a file with the names of the spectra to test on.

    Raises:
        InputError: bad run, dataset or index, or test spectra the run was trained on.
    """
    run = load_run(folder)
    trained_on = Path(run.config.dataset)
    dataset = read_dataset(dataset_folder or trained_on)
    same = dataset_folder is None or dataset_folder.resolve() == trained_on.resolve()
    if same:
        parts = run.split(dataset)
        known, test = parts.known, parts.test
        known_data = dataset
    else:
        known_data = read_dataset(trained_on)
        known, test = run.split(known_data).known, np.arange(len(dataset.names))
    if index is not None:
        test = read_index(index, dataset)
        both = np.intersect1d(test, known) if same else np.array([])
        if len(both):
            raise InputError(
                f"{index}: expected names of spectra the run was not trained on, found {dataset.names[both[0]]} and "
                f"{len(both) - 1} more that it was"
            )

    truth = dataset.pictures[test] / np.float32(255)
    positions = dataset.positions[test]
    pictures, places = known_data.pictures[known] / np.float32(255), known_data.positions[known]
    prediction = run.predict(positions).spectra
    some = evenly(np.arange(len(test)), SAMPLES)
    scores = {
        "model": score(prediction, truth),
        "mean_picture": score(mean_picture(pictures, positions), truth),
        "nearest": score(nearest(places, pictures, positions), truth),
        "inverse_distance": score(inverse_distance(places, pictures, positions), truth),
        "array_ceiling": score(array_ceiling(truth[some], run.array), truth[some]),
    }
    result = Evaluation(dataset, test, prediction, scores)

    out = folder / "evaluation"
    out.mkdir(exist_ok=True)
    write_atomically(out / "metrics.json", (json.dumps(result.metrics(), indent=2) + "\n").encode())
    write_atomically(out / "per_sample.csv", _table(result).encode())
    draw_ssim_distribution({name: each.ssim for name, each in scores.items()}, out / "ssim_cdf.png")
    draw_examples(prediction, truth, scores["model"].ssim, out / "examples.png")
    draw_examples_polar(prediction, truth, scores["model"].ssim, out / "examples_polar.png")
    write_evaluation(result, folder.name, out)
    return result


def _table(evaluation: Evaluation) -> str:
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["name", "x", "y", "z", "ssim", "psnr_db", "mae", "aoa_error_deg", "ssim_nearest"])
    model, copied = evaluation.scores["model"], evaluation.scores["nearest"]
    for row, index in enumerate(evaluation.test):
        position = evaluation.dataset.positions[index]
        figures = (model.ssim[row], model.psnr[row], model.mae[row], model.aoa_error[row], copied.ssim[row])
        writer.writerow([evaluation.dataset.names[index], *position, *(f"{value:.6f}" for value in figures)])
    return text.getvalue()
