"""How many training steps fit into a budget of minutes: a few steps, a validation and a checkpoint are timed."""

from __future__ import annotations

import time
from io import BytesIO

import numpy as np
import torch

from learn.comparison.task import Task
from learn.metrics import ssim
from learn.training.by_steps import STEPS_PER_VALIDATION
from learn.training.config import Config, Steps
from learn.training.lightning_module import Spectra, Training
from learn.training.run_folder import build_model
from learn.training.train import box_of


def seconds_per_step(config: Config, by_steps: Steps, task: Task) -> float:
    """Time of a training step with its share of a validation and a checkpoint, measured on throwaway weights.

    Args:
        config: which model is trained, and on what.
        by_steps: its batch size and learning rate.
        task: the spectra to time with.
    """
    module = Training(build_model(config, box_of(task.positions), task.array), by_steps.learning_rate, 100)
    device = "cuda" if torch.cuda.is_available() else "cpu"
    module.to(device)
    optimiser = module.configure_optimizers()["optimizer"]
    batch = np.arange(by_steps.batch_size) % len(task.parts.train)
    positions = torch.from_numpy(task.positions[batch]).float().to(device)
    spectra = torch.from_numpy(task.spectra[batch]).to(device)
    times = []
    for _ in range(4):
        began = time.perf_counter()
        optimiser.zero_grad()
        value = module.model.loss(positions, spectra)
        value.backward()
        optimiser.step()
        value.item()  # waits for a GPU
        times.append(time.perf_counter() - began)
    began = time.perf_counter()
    with torch.no_grad():
        prediction = module.model(positions).cpu().numpy()
    ssim(prediction, spectra.cpu().numpy())
    validation = (time.perf_counter() - began) / len(batch) * min(Spectra.VALIDATED, len(task.parts.validation))
    began = time.perf_counter()
    torch.save([module.state_dict(), optimiser.state_dict()], BytesIO())
    checkpoint = 2 * (time.perf_counter() - began)  # the last and the best
    return float(np.median(times[1:])) + (validation + checkpoint) / STEPS_PER_VALIDATION
