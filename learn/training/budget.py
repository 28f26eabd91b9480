"""How long a training takes, and how many steps fit into a budget of minutes, from the time of a few steps."""

from __future__ import annotations

import time
from bisect import bisect_right
from dataclasses import replace
from io import BytesIO
from typing import Any, NamedTuple

import lightning as L
import numpy as np
import torch
from lightning.pytorch.callbacks import Callback

from learn.data.splits import Split
from learn.models.base import SpectrumModel
from learn.models.capabilities import HasOwnLoss
from learn.models.model_settings import STEPS_MOST, Steps
from learn.models.quadrature import quadrature
from learn.training.gradient_steps import Spectra, Training
from learn.training.lightning_trainer import computing, interrupts, quiet_trainer
from learn.training.validation_part import VALIDATED, Learned, epochs_of, learned_responses
from scenes.files.plain_text import say
from simulate.dataset.dataset import Dataset

SLOWER, LEAST_TIMED, MOST_TIMED, SECONDS = 2, 3, 100, 1.0
"""The first steps are slower, and are not timed. Then so many steps are timed, or for so many seconds if there is time
for more than the least number."""


class Speed(NamedTuple):
    """How long parts of a training take."""

    step: float  # seconds of a step, on average over coarse and full steps
    validation: float  # seconds of a validation and its checkpoint

    def steps_in(self, minutes: float) -> int:
        """The largest number of steps that fit into the minutes with their validations, or 1 if not even one does."""
        return max(1, bisect_right(range(1, STEPS_MOST + 1), minutes, key=self.minutes_of))

    def minutes_of(self, steps: int) -> float:
        """How long a training of so many steps takes, with its validations."""
        return round((steps * self.step + len(epochs_of(steps)) * self.validation) / 60, 9)


class Timed(NamedTuple):
    """A training that was timed before it begins."""

    by_steps: Steps  # its settings
    learned: Learned  # the responses that the model learns from
    minutes: float  # how long it will take on this machine, with the search for these responses


def timed(
    budget: float | None,
    model: SpectrumModel,
    by_steps: Steps,
    dataset: Dataset,
    parts: Split,
    seed: int,
    processes: int = 1,
) -> Timed:
    """Estimate how long a training takes, or choose the number of its steps by the time that it may take."""
    learned = learned_responses(model, dataset, parts, by_steps)
    spent = learned.seconds / 60
    shared = replace(by_steps, batch_size=max(1, by_steps.batch_size // processes))
    speed = measured_speed(model, shared, dataset, parts, seed, learned)
    if budget is not None:
        by_steps = replace(by_steps, steps=speed.steps_in(budget - spent))
        if spent >= budget:
            say(
                f"warning: the search for responses behind the pictures took {spent:.2g} minutes, and the budget is "
                f"{budget:g}, so only one step is trained"
            )
    return Timed(by_steps, learned, spent + speed.minutes_of(by_steps.steps))


def measured_speed(
    model: SpectrumModel, by_steps: Steps, dataset: Dataset, parts: Split, seed: int, learned: Learned
) -> Speed:
    """Measure the speed of a training by a few of its steps."""
    pixels = quadrature(dataset.beamformer)
    spectra = Spectra(dataset, parts, by_steps.batch_size, seed, learned.responses)
    spectra.epochs = [MOST_TIMED]

    def seconds(full_resolution: float) -> float:
        clock = _Clock()
        few = replace(by_steps, steps=MOST_TIMED, full_resolution=full_resolution)
        trainer = quiet_trainer(
            max_epochs=1, use_distributed_sampler=False, logger=False, limit_val_batches=0, callbacks=[clock]
        )
        with interrupts(), computing(by_steps.matmul_precision, spectra.of_responses):
            trainer.fit(Training(model, few, pixels), datamodule=spectra)
        return float(np.diff(clock.ends[SLOWER:]).mean())

    share = 1.0 if isinstance(model, HasOwnLoss) else by_steps.full_resolution
    step = (share * seconds(1.0) if share else 0.0) + ((1 - share) * seconds(0.0) if share < 1 else 0.0)
    return Speed(step, _validation_seconds(model, by_steps, spectra))


def _validation_seconds(model: SpectrumModel, by_steps: Steps, spectra: Spectra) -> float:
    """Seconds of a validation, from one of its batches, and of a checkpoint."""
    module = Training(model, by_steps, quadrature(spectra.dataset.beamformer))
    clock = _Clock()
    trainer = quiet_trainer(logger=False, limit_val_batches=1, callbacks=[clock])
    with interrupts(), computing(by_steps.matmul_precision, spectra.of_responses):
        trainer.validate(module, datamodule=spectra, verbose=False)
    validated = min(VALIDATED, len(spectra.parts.validation))
    batches = max(1.0, validated / Spectra.VALIDATED_AT_ONCE)
    began = time.perf_counter()
    optimiser = module.configure_optimizers()["optimizer"]
    torch.save([module.state_dict(), optimiser.state_dict()], BytesIO())
    checkpoint = 4 * (time.perf_counter() - began)  # it also holds the moments of the weights, and the best weights
    return batches * (clock.validated - clock.began) + checkpoint


class _Clock(Callback):
    """Notes when each step and a validation end, and stops a training that has shown its speed."""

    def __init__(self) -> None:
        self.ends: list[float] = []
        self.began = self.validated = 0.0

    def on_train_batch_end(self, trainer: L.Trainer, module: L.LightningModule, outputs: Any, *_: Any) -> None:
        float(outputs["loss"])  # waits for the GPU
        self.ends.append(time.perf_counter())
        timed = len(self.ends) - SLOWER - 1
        trainer.should_stop = timed >= LEAST_TIMED and self.ends[-1] - self.ends[SLOWER] > SECONDS

    def on_validation_start(self, trainer: L.Trainer, module: L.LightningModule) -> None:
        self.began = time.perf_counter()

    def on_validation_end(self, trainer: L.Trainer, module: L.LightningModule) -> None:
        self.validated = time.perf_counter()
