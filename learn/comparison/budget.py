"""Time of a training step, from which the number of steps that fit into a budget of minutes follows."""

from __future__ import annotations

import time
from io import BytesIO

import numpy as np
import torch

from learn.comparison.task import Task
from learn.metrics import ssim
from learn.models.quadrature import quadrature
from learn.training.by_steps import STEPS_PER_VALIDATION
from learn.training.config import Config, Steps
from learn.training.lightning_module import Spectra, Training
from learn.training.run_folder import build_model
from learn.training.train import box_of
from simulate.spectrum import spectrum_of


def seconds_per_step(config: Config, by_steps: Steps, task: Task) -> float:
    """Measure the time of a training step, including its share of a validation and a checkpoint.

    The measurement trains a model of its own for a few steps.

    Args:
        config: settings of the run: which model is trained, on which dataset.
        by_steps: its batch size and learning rate.
        task: known spectra to measure with.

    Returns:
        Seconds per step.
    """
    model, pixels = build_model(config, box_of(task.positions), task.beamformer), quadrature(task.beamformer)
    module = Training(model, by_steps.learning_rate, 100, 0, pixels)
    device = "cuda" if torch.cuda.is_available() else "cpu"
    module.to(device)
    optimiser = module.configure_optimizers()["optimizer"]
    batch = np.arange(by_steps.batch_size) % len(task.parts.known)
    known = task.parts.known[batch]
    positions = torch.from_numpy(task.dataset.positions[known]).float().to(device)
    pictures = torch.from_numpy(task.dataset.pictures[known]).to(device)

    def median_seconds(coarse: bool) -> float:
        seconds = []
        for _ in range(4):
            began = time.perf_counter()
            optimiser.zero_grad()
            loss = module.loss(positions, pictures, coarse)
            loss.backward()
            optimiser.step()
            loss.item()  # waits for the GPU
            seconds.append(time.perf_counter() - began)
        return float(np.median(seconds[1:]))

    share = 1 - by_steps.full_resolution if model.trains_on_few_pixels else 0.0
    step_seconds = share * median_seconds(True) if share else 0.0
    step_seconds += (1 - share) * median_seconds(False) if share < 1 else 0.0
    began = time.perf_counter()
    with torch.no_grad():
        prediction = module.model(positions).cpu().numpy()
    ssim(prediction, spectrum_of(pictures.cpu().numpy()))
    seconds_per_spectrum = (time.perf_counter() - began) / len(batch)
    validation_seconds = seconds_per_spectrum * min(Spectra.VALIDATED, len(task.parts.validation))
    began = time.perf_counter()
    torch.save([module.state_dict(), optimiser.state_dict()], BytesIO())
    checkpoint_seconds = 2 * (time.perf_counter() - began)  # the last and the best checkpoint are both written
    return step_seconds + (validation_seconds + checkpoint_seconds) / STEPS_PER_VALIDATION
