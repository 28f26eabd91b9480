"""How good are the published models at their published sizes, trained for some minutes, and do they still improve?

bisplat simulate lab --placement path -n 6000 -o runs/lab-path
python -m benchmarks.learn.paper_size runs/lab-path --json

The models are trained at once, each in a process of its own, so that they share the GPU. The split is random, as that
of the paper's data is. With `--steps`, all take this number of steps instead. Before, a hundred steps and the
predictions of each model are timed alone. Beside the models are `helmholtz`, which uses the CPU, and two baselines that
copy and average known spectra. The runs are kept in a folder, where the same call continues them.
"""

from __future__ import annotations

import json
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory
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
from learn.models.model_settings import MatmulPrecision
from simulate.dataset.dataset_folder import read_dataset
from simulate.spectra.spectrum import spectrum_of

TIMED_STEPS, PREDICTED = 100, 1024
"""Number of steps that are timed alone, and of spectra predicted at once."""


class Size(NamedTuple):
    """A model and its options."""

    model: str
    options: dict[str, Any]


PAPER_SIZE = {
    "bisplat": Size("bisplat", {}),
    "bisplat-plus": Size("bisplat-plus", {}),
    "nerf2": Size("nerf2", {}),
    "swiftwrf": Size("swiftwrf", {}),
    "wrf-gs-plus": Size("wrf-gs-plus", {}),
    "gsrf": Size("gsrf", {}),
    "bisplat-aperture": Size("bisplat-aperture", {}),
}
"""The models by the label of their row."""

REDUCED = ("nerf2", "swiftwrf", "wrf-gs-plus", "gsrf")
"""Models that are also trained at the size that they have without a GPU, where there is none."""

SMALLEST = {"bisplat": Size("bisplat", {"primitives": 20, "clusters": 16, "ffn_width": 16, "ffn_layers": 1})}
"""The models where the benchmark is at its smallest."""


def device() -> str:
    """The GPU that PyTorch finds, or how many threads it uses."""
    from learn.training.run_files import device_name

    return device_name()


class Training(NamedTuple):
    """How each model is trained: for minutes or steps, and with which precision of matrix products."""

    minutes: float
    steps: int | None
    matmul_precision: MatmulPrecision

    def settings(self) -> dict[str, Any]:
        """Arguments of ``bisplat.train``."""
        length: dict[str, Any] = {"budget": self.minutes} if self.steps is None else {"steps": self.steps}
        return length | {"matmul_precision": self.matmul_precision, "split": "random"}


def timed_alone(dataset: Path, folder: Path, size: Size, training: Training) -> dict[str, float]:
    """Milliseconds of a training step, spectra predicted per second, and what a prediction's networks compute."""
    import torch
    from torch.utils.flop_counter import FlopCounterMode

    from learn.fitted.runs import train

    run = train(dataset, folder, model=size.model, options=size.options, **training.settings())
    positions = np.resize(read_dataset(dataset).positions, (PREDICTED, 3))
    run.predict(positions[:8])
    began = time.perf_counter()
    run.predict(positions)
    predicted = time.perf_counter() - began
    with FlopCounterMode(display=False) as counter:
        run.model(torch.from_numpy(positions[:1]).float().to(next(run.model.parameters()).device))
    kept = json.loads((folder / "training.json").read_text())
    return {
        "parameters": sum(each.numel() for each in run.model.parameters()),
        "GFLOP per spectrum": round(counter.get_total_flops() / 1e9, 2),  # matrix products; splatting is not counted
        "ms per step, first ones": round(1e3 * kept["seconds"] / kept["steps"], 1),
        "spectra per second": round(PREDICTED / predicted),
    }


def trained(dataset: Path, folder: Path, size: Size, training: Training) -> dict[str, Any]:
    """Train a model and score it on the test part."""
    from learn.fitted.runs import train
    from learn.reports.comparison_report import validation_curve

    run = train(dataset, folder, model=size.model, options=size.options, **training.settings())
    kept = json.loads((folder / "training.json").read_text())
    by_steps = json.loads((folder / "config.json").read_text())["by_steps"]
    at, similarity = validation_curve(folder)
    shares = {"a quarter of the steps": 0.25, "half of the steps": 0.5, "all steps": 1.0}
    steps_there = {name: share * by_steps["steps"] for name, share in shares.items()}
    return {
        **scores(run.predict, dataset),
        **{
            f"validation after {name}": round(float(np.interp(there, at, similarity)), 4)
            for name, there in steps_there.items()
            if there >= min(at)  # a slow model is validated later for the first time
        },
        "steps": by_steps["steps"],
        "spectra per step": by_steps["batch_size"],
        "minutes": round(kept["seconds"] / 60, 1),
    }


def fitted(dataset: Path, folder: Path) -> dict[str, Any]:
    """Scores of ``helmholtz``."""
    from learn.fitted.runs import train

    began = time.perf_counter()
    run = train(dataset, folder, model="helmholtz", split="random")
    minutes = (time.perf_counter() - began) / 60
    return scores(run.predict, dataset) | {"minutes": round(minutes, 1)}


def scores(predict: Any, path: Path) -> dict[str, float]:
    """Median and mean SSIM of the predicted test spectra."""
    dataset = read_dataset(path)
    test = split(dataset, "random", 0).test
    return _ssim(predict(dataset.positions[test]).spectra, spectrum_of(dataset.pictures[test]))


def copied(path: Path) -> dict[str, dict[str, float]]:
    """Scores of the nearest known spectrum, and of the mean of the four nearest, weighted by 1 / distance."""
    dataset = read_dataset(path)
    parts = split(dataset, "random", 0)
    known, spectra = dataset.positions[parts.known], spectrum_of(dataset.pictures[parts.known])
    test, truth = dataset.positions[parts.test], spectrum_of(dataset.pictures[parts.test])
    methods = {"nearest": nearest, "inverse-distance": inverse_distance}
    return {name: _ssim(method(known, spectra, test), truth) for name, method in methods.items()}


def _ssim(prediction: Float[np.ndarray, "K 90 360"], truth: Float[np.ndarray, "K 90 360"]) -> dict[str, float]:
    similarity = ssim(prediction, truth)
    return {"SSIM median": round(float(np.median(similarity)), 4), "SSIM mean": round(float(similarity.mean()), 4)}


def chosen(models: tuple[str, ...]) -> dict[str, Size]:
    """The trained models by the label of their row."""
    import torch

    from learn.training.registry import MODELS

    found = PAPER_SIZE
    if not torch.cuda.is_available():
        found = found | {f"{name} (reduced)": Size(name, dict(MODELS[name].options_without_gpu)) for name in REDUCED}
    return {label: size for label, size in found.items() if not models or label in models}


def main(
    dataset: Positional[Path],
    folder: Path = Path("runs/paper-size"),
    models: tuple[str, ...] = (),
    minutes: float = 6.0,
    steps: int | None = None,
    matmul_precision: MatmulPrecision = "highest",
    at_once: int = 6,
    figure: Path | None = None,
    smallest: bool = False,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Train the published models at their published sizes."""
    sizes = SMALLEST if smallest else chosen(models)
    training = Training(minutes, 2 if smallest else steps, matmul_precision)
    timed = training._replace(steps=2 if smallest else TIMED_STEPS)
    with TemporaryDirectory() as temporary:
        folder = Path(temporary) if smallest else folder
        alone = {label: timed_alone(dataset, folder / "alone" / label, size, timed) for label, size in sizes.items()}
        with ProcessPoolExecutor(at_once, mp_context=get_context("spawn")) as pool:
            trainings = {
                label: pool.submit(trained, dataset, folder / label, size, training) for label, size in sizes.items()
            }
            closed_form = pool.submit(fitted, dataset, folder / "helmholtz")
            table = {}
            for label, scored in trainings.items():
                table[label] = alone[label] | scored.result()
                print(label, table[label], file=sys.stderr)  # a failure of a later model loses nothing
            table["helmholtz"] = closed_form.result()
        if figure is not None:
            draw({"": {label: folder / label for label in sizes}}, figure)
    print_figures(table | copied(dataset) | {"device": device()}, json_output, smallest)


if __name__ == "__main__":
    tyro.cli(main)
