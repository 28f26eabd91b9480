"""How good are the paper's models if they are trained until longer training no longer helps?

python -m benchmarks.learn.plateau runs/lab-path data/rfid-s23-160 --figure docs/generated/plateau.png --json

The datasets are a simulated path, split at random as the paper's data is, and the measured sample with its own split.
The figures are the median and mean SSIM of test spectra after trainings of several lengths, each with its own warm-up
and cosine schedule, and the validation SSIM of the weights that were kept. Beside them are two baselines: copying the
nearest known spectrum, and averaging the nearest. The runs are kept in a folder for the next call.
"""

from __future__ import annotations

import json
import tempfile
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
import tyro
from jaxtyping import Float
from tyro.conf import Positional

from benchmarks.ledger.printing import print_figures
from benchmarks.ledger.validation_figure import draw
from learn.data.metrics import ssim
from learn.data.neighbours import inverse_distance, nearest
from learn.data.splits import split
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_folder import read_dataset
from simulate.spectra.spectrum import evenly, spectrum_of

TESTED = 300
"""Largest number of test spectra, evenly spread."""

SIMULATED, MEASURED = (2000, 8000), (500, 2000)
"""Numbers of steps of the trainings of ``bisplat``; its variants have the largest."""

DEEP = {"primitives": 500, "ffn_width": 128, "transformer_ffn_width": 256}
"""What is reduced of ``bisplat-plus``: it is as deep as in the paper, but as wide, and with as many primitives, as
``bisplat``."""

SMALL = {"primitives": 20, "clusters": 16, "ffn_width": 16, "ffn_layers": 1, "transformer_layers": 1}
"""Options of the models where the benchmark is at its smallest."""


class Trained(NamedTuple):
    """A model as it is trained: its name, options and number of steps."""

    model: str
    options: dict[str, Any]
    steps: int


def trainings(lengths: tuple[int, ...]) -> dict[str, Trained]:
    """What is trained on a dataset, by the label of its row and the name of its folder."""
    longest = max(lengths)
    return {
        **{f"bisplat, {steps} steps": Trained("bisplat", {}, steps) for steps in lengths},
        **{
            f"bisplat without {part}, {longest} steps": Trained("bisplat", {"bypass": [branch]}, longest)
            for part, branch in (("BST", "bst"), ("dynamic network", "dynamic"), ("delta decoder", "delta"))
        },
        f"bisplat-plus (reduced), {longest // 2} steps": Trained("bisplat-plus", DEEP, longest // 2),
    }


def scores(prediction: Float[np.ndarray, "K 90 360"], truth: Float[np.ndarray, "K 90 360"]) -> dict[str, float]:
    """Median and mean SSIM."""
    similarity = ssim(prediction, truth)
    return {"SSIM median": round(float(np.median(similarity)), 4), "SSIM mean": round(float(similarity.mean()), 4)}


def trained(dataset: Dataset, folder: Path, training: Trained) -> dict[str, float]:
    """Scores of a training. A run that is in the folder is not trained again."""
    from learn.fitted.runs import train

    model, options, steps = training
    run = train(dataset, folder, model=model, options=options, steps=steps)
    test = evenly(run.split(dataset).test, TESTED)
    kept = json.loads((folder / "training.json").read_text())
    return scores(run.predict(dataset.positions[test]).spectra, spectrum_of(dataset.pictures[test])) | {
        "validation": round(kept["validation_ssim"], 4),
        "minutes": round(kept["seconds"] / 60, 1),
    }


def copied(dataset: Dataset) -> dict[str, dict[str, float]]:
    """Scores of the nearest known spectrum, and of the mean of the four nearest, weighted by 1 / distance."""
    parts = split(dataset, "files", 0)
    test = evenly(parts.test, TESTED)
    known, spectra = dataset.positions[parts.known], spectrum_of(dataset.pictures[parts.known])
    truth = spectrum_of(dataset.pictures[test])
    return {
        name: scores(method(known, spectra, dataset.positions[test]), truth)
        for name, method in (("nearest", nearest), ("inverse-distance", inverse_distance))
    }


def main(
    simulated: Positional[Path],
    measured: Positional[Path],
    folder: Path = Path("runs/plateau"),
    figure: Path | None = None,
    smallest: bool = False,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Train the paper's models to their plateau."""
    result: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary) if smallest else folder
        for name, path, lengths in (("simulated", simulated, SIMULATED), ("measured", measured, MEASURED)):
            dataset = read_dataset(path)
            for label, training in trainings((2,) if smallest else lengths).items():
                if smallest:
                    training = training._replace(options=training.options | SMALL)
                result[f"{name}, {label}"] = trained(dataset, folder / name / label, training)
            result |= {f"{name}, {label}": figures for label, figures in copied(dataset).items()}
        if figure is not None:
            names = ("simulated", "measured")
            draw({name: {run.name: run for run in sorted((folder / name).iterdir())} for name in names}, figure)
    print_figures(result, json_output, smallest)


if __name__ == "__main__":
    tyro.cli(main)
