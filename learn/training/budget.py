"""How many training steps fit into a budget of minutes, extrapolated from the time that a few steps take."""

from __future__ import annotations

import time
from dataclasses import replace
from io import BytesIO

import numpy as np
import torch

from learn.data.metrics import ssim_of_each
from learn.data.splits import Split
from learn.models.base import SpectrumModel
from learn.models.capabilities import HasOwnLoss
from learn.models.quadrature import quadrature
from learn.models.steps import Steps
from learn.training.by_steps import STEPS_PER_VALIDATION, VALIDATIONS
from learn.training.found_responses import Learned, learned_responses
from learn.training.lightning_module import Spectra, Training
from simulate.dataset.dataset_folder import Dataset
from simulate.spectra.spectrum import spectrum_of


def within(
    minutes: float, model: SpectrumModel, by_steps: Steps, dataset: Dataset, parts: Split, seed: int
) -> tuple[Steps, Learned]:
    """Choose the number of steps that fit into a given time. The search for responses behind pictures counts, too.

    Args:
        minutes: the time.
        model: the model, which is trained for a few steps to measure its speed.
        by_steps: its batch size and learning rate.
        dataset: the dataset.
        parts: its split.
        seed: seed of the order of the spectra.

    Returns:
        The settings with this number of steps, and the responses that the model learns from.
    """
    learned = learned_responses(model, dataset, parts, by_steps)
    left = minutes - learned.seconds / 60
    return replace(by_steps, steps=steps_within(left, model, by_steps, dataset, parts, seed, learned)), learned


def steps_within(
    minutes: float, model: SpectrumModel, by_steps: Steps, dataset: Dataset, parts: Split, seed: int, learned: Learned
) -> int:
    """The number of training steps, with their validations and checkpoints, that fit into a given time.

    Args:
        minutes: the time.
        model: the model, which is trained for a few steps to measure its speed.
        by_steps: its batch size and learning rate.
        dataset: the dataset.
        parts: its split; spectra of the training part measure the speed.
        seed: seed of the order of the spectra.
        learned: the responses that the model learns from, if any.

    Returns:
        Number of steps, at least 1.
    """
    module = Training(model, by_steps, quadrature(dataset.beamformer))
    device = "cuda" if torch.cuda.is_available() else "cpu"
    module.to(device)
    optimiser = module.configure_optimizers()["optimizer"]
    spectra = Spectra(dataset, parts, by_steps.batch_size, seed, learned.responses)
    positions, pictures, responses = (part.to(device) for part in next(iter(spectra.train_dataloader())))

    def median_seconds(coarse: bool) -> float:
        seconds = []
        for _ in range(4):
            began = time.perf_counter()
            optimiser.zero_grad()
            loss = module.loss(positions, pictures, responses, coarse)
            loss.backward()
            optimiser.step()
            loss.item()  # waits for the GPU
            seconds.append(time.perf_counter() - began)
        return float(np.median(seconds[1:]))

    share = 0.0 if isinstance(model, HasOwnLoss) else 1 - by_steps.full_resolution
    step_seconds = share * median_seconds(True) if share else 0.0
    step_seconds += (1 - share) * median_seconds(False) if share < 1 else 0.0
    validated = min(Spectra.VALIDATED_AT_ONCE, len(positions))
    began = time.perf_counter()
    with torch.no_grad():
        prediction = module.model(positions[:validated]).cpu().numpy()
    ssim_of_each(prediction, spectrum_of(pictures[:validated].cpu().numpy()))
    seconds_per_spectrum = (time.perf_counter() - began) / validated
    validation_seconds = seconds_per_spectrum * min(Spectra.VALIDATED, len(parts.validation))
    began = time.perf_counter()
    torch.save([module.state_dict(), optimiser.state_dict()], BytesIO())
    checkpoint_seconds = 2 * (time.perf_counter() - began)  # a checkpoint also holds averaged weights and the best ones
    validation_seconds += checkpoint_seconds
    steps = 60 * minutes / (step_seconds + validation_seconds / STEPS_PER_VALIDATION)
    if steps > STEPS_PER_VALIDATION * VALIDATIONS:
        steps = (60 * minutes - VALIDATIONS * validation_seconds) / step_seconds
    return max(1, round(steps))
