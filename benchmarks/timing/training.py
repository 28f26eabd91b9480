"""The training loop of bisplat-aperture as it is and as first written, and how long their steps take."""

from __future__ import annotations

import json
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pandas as pd
import torch
from lightning.pytorch.callbacks import Callback
from pytorch_msssim import ssim

import learn.models.loss
import learn.models.splat
import learn.training.by_steps
import learn.training.lightning_module
from learn.models.bisplat import BiSplatAperture, BiSplatWRF
from learn.models.loss import composite_loss
from learn.models.quadrature import quadrature
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
    module = learn.training.lightning_module.Training(model, 1e-4, 1000, 0, quadrature(Beamformer()))
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


def training(dataset: Path, steps: int, options: dict[str, int], full_resolution: float) -> tuple[float, pd.Series]:
    """Seconds of a training, and the median validation SSIM by step; a share of the steps looks at all pixels."""
    with tempfile.TemporaryDirectory() as folder:
        run = Path(folder) / "run"
        train(dataset, run, model=MODEL, steps=steps, options=options, full_resolution=full_resolution)
        (log,) = (run / "logs").rglob("metrics.csv")
        validated = pd.read_csv(log).dropna(subset=["validation_ssim"]).set_index("step")["validation_ssim"]
        return json.loads((run / "training.json").read_text())["seconds"], validated
