"""Training by gradient steps. Lightning runs the loop, keeps the best weights and resumes."""

from __future__ import annotations

import logging
import signal
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import lightning as L
import torch
from lightning.pytorch.callbacks import Callback, Timer
from lightning.pytorch.loggers import CSVLogger, TensorBoardLogger
from rich.progress import TextColumn

from learn.models.base import SpectrumModel
from learn.models.model_settings import MatmulPrecision, Processes, Steps
from learn.models.quadrature import Quadrature
from learn.training.checkpoints import LAST, UNREADABLE, Checkpoints, WholeFiles, has_checkpoint
from learn.training.epochs import epochs_of
from learn.training.lightning_module import Spectra, Training
from learn.training.run_folder import save_weights
from learn.training.training_file import write_training
from learn.training.validation_scores import told, validate
from scenes.files.errors import InputError, printable
from scenes.files.progress import progress_bar

GRADIENT_NORM = 1.0
"""Gradients are clipped to this norm."""


class ProgressOnStderr(Callback):
    """Shows steps, remaining time, loss and the last validation SSIM on stderr."""

    def __init__(self, steps: int) -> None:
        self._steps = steps
        self._progress = progress_bar(TextColumn("{task.fields[figures]}"))

    def on_train_start(self, trainer: L.Trainer, module: L.LightningModule) -> None:
        if trainer.is_global_zero:
            self._progress.start()
        self._bar = self._progress.add_task("training", total=self._steps, completed=trainer.global_step, figures="")

    def on_train_batch_end(self, trainer: L.Trainer, module: L.LightningModule, *_) -> None:
        metrics = {name: trainer.callback_metrics.get(name) for name in ("loss", "validation_ssim")}
        text = "  ".join(f"{name} {float(value):.4f}" for name, value in metrics.items() if value is not None)
        self._progress.update(self._bar, completed=trainer.global_step, figures=text)

    def teardown(self, trainer: L.Trainer, module: L.LightningModule, stage: str) -> None:
        self._progress.stop()


def quiet_trainer(**settings: Any) -> L.Trainer:
    """Lightning's loop as every training uses it: with clipped gradients, and without messages and files of its own."""
    for name in ("lightning.pytorch", "lightning.fabric"):
        logging.getLogger(name).setLevel(logging.ERROR)
    warnings.filterwarnings("ignore", module="lightning")
    return L.Trainer(
        accelerator="auto",
        num_sanity_val_steps=0,
        gradient_clip_val=GRADIENT_NORM,
        enable_checkpointing=False,  # Lightning's own; ours is one of the callbacks
        enable_progress_bar=False,
        enable_model_summary=False,
        **settings,
    )


@contextmanager
def interrupts() -> Iterator[None]:
    """Turn the end of Lightning's loop by SIGINT or SIGTERM into KeyboardInterrupt.

    Lightning raises SystemExit with various statuses, and ignores later SIGINTs.
    """
    on_interrupt = signal.getsignal(signal.SIGINT)
    try:
        yield
    except SystemExit:
        signal.signal(signal.SIGINT, on_interrupt)
        raise KeyboardInterrupt from None


@contextmanager
def multiplying(precision: MatmulPrecision) -> Iterator[None]:
    """Multiply matrices of single precision with this precision, and then with the one before again."""
    before = torch.get_float32_matmul_precision()
    torch.set_float32_matmul_precision(precision)
    try:
        yield
    finally:
        torch.set_float32_matmul_precision(before)


def train_by_steps(
    model: SpectrumModel,
    spectra: Spectra,
    by_steps: Steps,
    pixels: Quadrature,
    folder: Path,
    processes: Processes = Processes(),
    seconds_before: float = 0.0,
) -> None:
    """Train a model by gradient steps, from the folder's last checkpoint if it has one, and save its weights."""
    spectra.epochs = epochs_of(by_steps.steps)
    last = folder / "checkpoints" / LAST
    resumed = has_checkpoint(last.parent)
    checkpoints = Checkpoints(last)
    timer = Timer()  # its state is in the checkpoint, so it includes the time before an interruption
    # Each start of a training gets a new log folder, since CSVLogger deletes a log that it finds.
    attempt = len(list(folder.glob("logs/version_*")))
    trainer = quiet_trainer(
        max_epochs=len(spectra.epochs),
        reload_dataloaders_every_n_epochs=1,  # each epoch has its own number of steps
        devices=processes.devices,
        num_nodes=processes.nodes,
        use_distributed_sampler=False,  # Spectra shares the batches among the processes itself
        # A branch that is bypassed gets no gradient; this strategy of DDP allows that.
        strategy="auto" if processes.count == 1 else "ddp_find_unused_parameters_true",
        callbacks=[timer, ProgressOnStderr(by_steps.steps), checkpoints],
        plugins=[WholeFiles()],
        logger=[
            CSVLogger(folder, name="logs", version=attempt),
            TensorBoardLogger(folder, name="logs", version=attempt),
        ],
    )
    try:
        with interrupts(), multiplying(by_steps.matmul_precision):
            trainer.fit(
                Training(model, by_steps, pixels),
                datamodule=spectra,
                ckpt_path=last if resumed else None,
                weights_only=True,
            )
    except InputError:
        raise
    except UNREADABLE as error:
        if resumed and not checkpoints.restored and not isinstance(error, torch.OutOfMemoryError):  # of a full GPU
            raise InputError(
                f"{last.parent}: expected checkpoints of this training, found those of another one "
                f"({printable(str(error).splitlines()[0])}); move them away to train from the start"
            ) from error
        if isinstance(error, OSError) and error.filename is None:  # a log on a full disk raises such an error
            error.filename = str(folder)
        raise
    if trainer.is_global_zero:
        model.load_state_dict({name.removeprefix("model."): value for name, value in checkpoints.weights.items()})
        data, parts = spectra.dataset, spectra.parts
        deviation = validate(model.eval(), data, parts).deviation
        told(deviation, len(parts.validation))
        seconds = seconds_before + timer.time_elapsed("train")
        write_training(folder, by_steps.steps, seconds, checkpoints.score, deviation, data.positions[parts.train])
        save_weights(folder, model)
    trainer.strategy.barrier()  # the other processes wait until the weights are written
