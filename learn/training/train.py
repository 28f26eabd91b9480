"""Train a model on a dataset folder into a run folder; the same command again resumes."""

from __future__ import annotations

import logging
import signal
import time
import warnings
from dataclasses import asdict
from pathlib import Path

import lightning as L
import numpy as np
import torch
from jaxtyping import Float
from lightning.pytorch.callbacks import Callback, EMAWeightAveraging, ModelCheckpoint, Timer
from lightning.pytorch.loggers import CSVLogger, TensorBoardLogger
from lightning.pytorch.utilities import rank_zero_only
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from learn.metrics import ssim
from learn.models.helmholtz import HelmholtzField
from learn.output_folder import claim
from learn.splits import Split, evenly, split
from learn.training.lightning_module import Spectra, Training
from learn.training.run_folder import (
    Config,
    build_model,
    load_weights,
    predict,
    read_config,
    save_weights,
    write_config,
    write_training,
)
from scenes.errors import InputError
from simulate.dataset import Dataset, read_dataset

STEPS_PER_VALIDATION = 100
"""Where an epoch is longer than this, it ends here: the next one draws anew from all of the training part."""

AVERAGED = 0.99
"""Validated and kept are weights averaged over the last steps, the latest weighing 1 − AVERAGED."""

GRADIENT_NORM = 1.0
"""Gradients are clipped to this norm."""


class ProgressOnStderr(Callback):
    """Steps, time left, loss and the current validation SSIM."""

    def __init__(self, steps: int) -> None:
        self._steps = steps
        self._progress = Progress(
            TextColumn("training"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[figures]}"),
            TimeRemainingColumn(),
            console=Console(stderr=True),
        )

    def on_train_start(self, trainer: L.Trainer, module: L.LightningModule) -> None:
        if trainer.is_global_zero:
            self._progress.start()
        self._bar = self._progress.add_task("", total=self._steps, completed=trainer.global_step, figures="")

    def on_train_batch_end(self, trainer: L.Trainer, module: L.LightningModule, *_) -> None:
        figures = {name: trainer.callback_metrics.get(name) for name in ("loss", "validation_ssim")}
        text = "  ".join(f"{name} {float(value):.4f}" for name, value in figures.items() if value is not None)
        self._progress.update(self._bar, completed=trainer.global_step, figures=text)

    def teardown(self, trainer: L.Trainer, module: L.LightningModule, stage: str) -> None:
        self._progress.stop()


def train(config: Config, folder: Path, devices: int = 1, nodes: int = 1) -> None:
    """Train, or go on with a run that was interrupted, or return at once if it is finished.

    An interrupted run goes on from its last epoch and ends with the weights it would have had.

    Args:
        devices: GPUs (processes where there is none) per machine; Lightning starts one process for each.
        nodes: machines; the launcher of the cluster starts this command on each.

    Raises:
        InputError: the batch cannot be shared by so many devices, the dataset is bad, or the folder holds something
            else than this very run, or the model has no such options.
    """
    if config.batch_size % (devices * nodes):
        raise InputError(f"--batch-size: expected a multiple of {devices * nodes} devices, found {config.batch_size}")
    if config.model == "helmholtz" and (config.init is not None or config.bypass):
        raise InputError("--init, --bypass: expected a model trained by steps, found helmholtz")
    dataset = read_dataset(config.dataset)
    first = getattr(rank_zero_only, "rank", 0) == 0  # of several processes, one writes
    if first:
        begun = asdict(read_config(folder)[0]) if (folder / "config.json").exists() else None
        claim(folder, "run", asdict(config), begun)
    parts = split(dataset, config.split, config.split_seed, config.train_size)
    if (folder / "weights.safetensors").exists():
        return
    if first:
        write_config(folder, config, dataset.array, parts, dataset.names)

    for name in ("lightning.pytorch", "lightning.fabric"):
        logging.getLogger(name).setLevel(logging.ERROR)
    warnings.filterwarnings("ignore", module="lightning")
    L.seed_everything(config.seed, verbose=False)
    model = build_model(config, box_of(dataset.positions[parts.known]), dataset.array)
    if isinstance(model, HelmholtzField):
        fit_in_closed_form(model, dataset, parts, folder)
        return
    if config.init is not None:
        load_weights(model, Path(config.init))

    spectra = Spectra(dataset, parts, config.batch_size, config.seed)
    period = min(STEPS_PER_VALIDATION, config.steps)
    batches = min(spectra.batches, period)
    # Whole periods between validations, so that the last weights are validated too.
    every = max(1, round(period / batches))
    epochs = every * max(1, round(config.steps / (every * batches)))
    steps = epochs * batches
    checkpoints = ModelCheckpoint(
        folder / "checkpoints",
        filename="best",
        monitor="validation_ssim",
        mode="max",
        save_last=True,
        enable_version_counter=False,
    )
    timer = Timer()  # goes on counting when a run is resumed
    # A folder for each start: CSVLogger deletes the log it finds.
    attempt = len(list(folder.glob("logs/version_*")))
    trainer = L.Trainer(
        max_epochs=epochs,
        limit_train_batches=batches,
        accelerator="auto",
        devices=devices,
        num_nodes=nodes,
        use_distributed_sampler=False,  # ours know what they are doing
        strategy=_strategy(config, devices * nodes),
        check_val_every_n_epoch=every,
        num_sanity_val_steps=0,
        gradient_clip_val=GRADIENT_NORM,
        callbacks=[EMAWeightAveraging(decay=AVERAGED), checkpoints, timer, ProgressOnStderr(steps)],
        logger=[
            CSVLogger(folder, name="logs", version=attempt),
            TensorBoardLogger(folder, name="logs", version=attempt),
        ],
        enable_progress_bar=False,
        enable_model_summary=False,
    )
    last = folder / "checkpoints" / "last.ckpt"
    on_interrupt = signal.getsignal(signal.SIGINT)
    try:
        trainer.fit(
            Training(model, config.learning_rate, steps),
            datamodule=spectra,
            ckpt_path=last if last.exists() else None,
            weights_only=False,
        )
    except SystemExit:
        # Lightning leaves the program on SIGINT and SIGTERM, with any status, and has further SIGINTs ignored.
        signal.signal(signal.SIGINT, on_interrupt)
        raise KeyboardInterrupt from None
    if not first:
        return
    best = torch.load(folder / "checkpoints" / "best.ckpt", map_location="cpu", weights_only=False)
    model.load_state_dict({name.removeprefix("model."): value for name, value in best["state_dict"].items()})
    write_training(folder, steps, timer.time_elapsed("train"), float(checkpoints.best_model_score or 0))
    save_weights(folder, model)


def fit_in_closed_form(model: HelmholtzField, dataset: Dataset, parts: Split, folder: Path) -> None:
    """Fit and validate on the training part, then fit on the validation part too, as every interpolation does."""
    began = time.perf_counter()
    status = Console(stderr=True).status("fitting the law of the field")
    with status:
        model.fit(dataset, parts.train)
    some = evenly(parts.validation, Spectra.VALIDATED)
    validation_ssim = 0.0
    if len(some):
        prediction = predict(model, dataset.positions[some]).spectra
        validation_ssim = float(np.median(ssim(prediction, dataset.pictures[some] / np.float32(255))))
    with status:
        model.fit(dataset, parts.known)
    write_training(folder, 0, time.perf_counter() - began, validation_ssim)
    save_weights(folder, model)


def box_of(positions: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "2 3"]:
    """Corners of the box around positions; a coordinate that never changes is given a width, to be divided by."""
    low, high = positions.min(axis=0), positions.max(axis=0)
    return np.stack([low, np.maximum(high, low + 1e-3)])


def _strategy(config: Config, processes: int) -> str:
    if processes == 1:
        return "auto"
    # The parameters of a bypassed branch get no gradient, which DDP must be told.
    return "ddp_find_unused_parameters_true" if config.bypass else "ddp"
