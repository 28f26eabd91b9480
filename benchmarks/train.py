"""How long training bisplat-aperture takes with the training loop as first written, and with the loop as it is.

python benchmarks/train.py runs/demo/dataset --json

Measured: milliseconds of a training step of eight spectra and of its parts (renderer, loss, optimiser, networks), the
median of ten; seconds of a whole training with either loop on the same dataset, with the same seed, steps, batch and
learning rate; and the seconds that the loop as it is needs for the validation SSIM that the first one ends with.

As first written, the loop used the reference renderer (learn.models.splat.splat_reference), computed the loss's SSIM
one spectrum at a time and the AdamW update one parameter at a time, did not average weights, and encoded the position
in six octaves instead of three.
"""

from __future__ import annotations

import json
import os
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any
from unittest.mock import patch

import numpy as np
import pandas as pd
import torch
import tyro
from lightning.pytorch.callbacks import Callback
from pytorch_msssim import ssim
from report.printing import print_figures
from tyro.conf import Positional

import learn.models.loss
import learn.models.splat
import learn.training.by_steps
import learn.training.lightning_module
from learn.models.bisplat import BiSplatAperture, BiSplatWRF
from learn.models.encoding import TX_ORDER
from learn.models.loss import composite_loss
from learn.models.registry import MODELS
from learn.training.train import train
from simulate.beamformer import Beamformer

MODEL = "bisplat-aperture"
REGION = np.array([[0.0, 0.0, 0.0], [1.6, 1.3, 0.9]])
SMALL = {"primitives": 20, "clusters": 16, "ffn_width": 16, "transformer_layers": 1, "transformer_ffn_width": 16}
"""What differs from the model's own size where the benchmark is at its smallest."""


def ssim_one_by_one(prediction: torch.Tensor, truth: torch.Tensor, data_range: float) -> torch.Tensor:
    """The SSIM of the loss as first written: of spectra [B, 90, 360], one at a time."""
    return ssim(prediction.transpose(0, 1), truth.transpose(0, 1), data_range=data_range)


@contextmanager
def as_first_written() -> Iterator[None]:
    """The training loop as first written, for as long as the context lasts."""
    adamw = torch.optim.AdamW
    with (
        patch.object(learn.models.splat, "splat_cpu", learn.models.splat.splat_reference),
        patch.object(learn.models.loss, "gaussian_ssim", ssim_one_by_one),
        patch.object(torch.optim, "AdamW", lambda parameters, fused, **settings: adamw(parameters, **settings)),
        patch.object(learn.training.by_steps, "EMAWeightAveraging", lambda decay: Callback()),
    ):
        yield


def milliseconds(function: Callable[[], Any], repeats: int) -> float:
    """Median milliseconds of so many calls; two more before them are not counted."""
    times = []
    for _ in range(repeats + 2):
        began = time.perf_counter()
        function()
        times.append(1e3 * (time.perf_counter() - began))
    return float(np.median(times[2:]))


def step_milliseconds(
    smallest: bool, batch: int = 8, networks: Callable[[BiSplatWRF], None] = lambda model: None
) -> dict[str, float]:
    """Milliseconds of a training step and its parts; the networks' are what the other parts leave of the step's."""
    torch.manual_seed(0)
    model = BiSplatAperture(REGION, Beamformer(), **{**MODELS[MODEL].options, **(SMALL if smallest else {})})
    repeats = 1 if smallest else 10
    networks(model)
    module = learn.training.lightning_module.Training(model, 1e-4, 1000)
    optimiser = module.configure_optimizers()["optimizer"]
    positions = torch.from_numpy(REGION[0] + np.random.default_rng(0).random((batch, 3)) * np.ptp(REGION, axis=0))
    positions, truth = positions.float(), torch.randint(0, 256, (batch, 90, 360), dtype=torch.uint8)

    def step() -> None:
        optimiser.zero_grad()
        model.loss(positions, truth.float() / 255).backward()
        torch.nn.utils.clip_grad_norm_(model.parameters(), 1.0)
        optimiser.step()

    inputs: list[Any] = []
    with patch("learn.models.bisplat.splat", lambda *given: inputs.extend(given) or learn.models.splat.splat(*given)):
        prediction = model(positions).detach()
    inputs = [value.detach().requires_grad_(index < 7) for index, value in enumerate(inputs)]

    def loss_backward() -> None:
        composite_loss(prediction.clone().requires_grad_(), truth.float() / 255).backward()

    times = {
        "step": milliseconds(step, repeats),
        "renderer": milliseconds(lambda: learn.models.splat.splat(*inputs).square().sum().backward(), repeats),
        "loss": milliseconds(loss_backward, repeats),
        "optimiser": milliseconds(optimiser.step, repeats),
    }
    return times | {"networks": times["step"] - times["renderer"] - times["loss"] - times["optimiser"]}


def training(dataset: Path, steps: int, options: dict[str, int]) -> tuple[float, pd.Series]:
    """Seconds of a training, and the median validation SSIM by step."""
    with tempfile.TemporaryDirectory() as folder:
        run = Path(folder) / "run"
        train(dataset, run, model=MODEL, steps=steps, options=options)
        (log,) = (run / "logs").rglob("metrics.csv")
        validated = pd.read_csv(log).dropna(subset=["validation_ssim"]).set_index("step")["validation_ssim"]
        return json.loads((run / "training.json").read_text())["seconds"], validated


def main(
    dataset: Positional[Path],
    steps: int = 1500,
    smallest: bool = False,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Time both training loops.

    Args:
        dataset: folder of the dataset to train on; the figures of docs/results.md are of the demo's.
        steps: optimiser steps of both.
        smallest: a run of seconds that shows that the benchmark works; its figures mean nothing.
        json_output: print one JSON object.
    """
    backend, options = "inductor", {}
    if smallest:
        steps, options = 2, SMALL
        backend = "eager"  # traces the networks as the other does, and spares the minute of C++ compilation

    def compile_networks(model: BiSplatWRF) -> None:
        for part in (model.bst, model.delta):
            part.compile(backend=backend)

    ours = step_milliseconds(smallest)
    compiled = step_milliseconds(smallest, networks=compile_networks)
    with torch.autocast("cpu", torch.bfloat16):
        half = step_milliseconds(smallest)
    with as_first_written():
        first = step_milliseconds(smallest)
        first_seconds, first_ssim = training(dataset, steps, {**options, "tx_order": TX_ORDER})
    our_seconds, our_ssim = training(dataset, steps, options)

    final = float(first_ssim.iloc[-1])
    reached = our_ssim.index[our_ssim >= final]
    to_final = our_seconds * (reached[0] + 1) / (our_ssim.index[-1] + 1) if len(reached) else None
    result: dict[str, Any] = {
        "final_validation_ssim_first": round(final, 4),
        "final_validation_ssim_ours": round(float(our_ssim.iloc[-1]), 4),
        "seconds_first": first_seconds,
        "seconds_ours": our_seconds,
        "seconds_to_final_ssim_of_first": None if to_final is None else round(to_final, 1),
        "ratio_to_final_ssim": None if to_final is None else round(first_seconds / to_final, 1),
        **{f"first_{name}_ms": round(value, 1) for name, value in first.items()},
        **{f"ours_{name}_ms": round(value, 1) for name, value in ours.items()},
        "networks_compiled_step_ms": round(compiled["step"], 1),
        "bfloat16_step_ms": round(half["step"], 1),
        "threads": torch.get_num_threads(),
        "cores": os.cpu_count(),
    }
    print_figures(result, json_output, smallest)


if __name__ == "__main__":
    tyro.cli(main)
