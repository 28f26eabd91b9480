"""Lightning's Trainer as every training by steps uses it: where it runs, progress, interrupts and checkpoints.

Checkpoints hold only plain data, so that reading them runs no code, and are never left half written. There are two,
``last.ckpt`` and the one before it, ``previous.ckpt``. Each holds everything that is needed to resume the training,
including the best weights so far.
"""

from __future__ import annotations

import logging
import math
import os
import signal
import struct
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from io import BytesIO
from itertools import accumulate
from pathlib import Path
from pickle import UnpicklingError
from typing import Any
from zipfile import ZIP_STORED, BadZipFile, ZipFile

import lightning as L
import torch
from lightning.fabric.plugins import CheckpointIO
from lightning.fabric.utilities.exceptions import MisconfigurationException
from lightning.pytorch.callbacks import Callback, EarlyStopping
from lightning.pytorch.utilities import rank_zero_only
from rich.progress import TextColumn
from torch import Tensor

from learn.models.model_settings import MatmulPrecision
from scenes.files.atomic import sync_folder, write_atomically
from scenes.files.errors import InputError, ParameterError, reason, shown
from scenes.files.input_file import require_regular
from scenes.files.plain_text import say
from scenes.files.progress import progress_bar

GRADIENT_NORM = 1.0  # Gradients are clipped to this norm

WHERE = ("accelerator", "devices", "num_nodes", "strategy")
"""Arguments of Lightning's Trainer that say where a training runs, and change its weights by rounding alone."""

LAST, PREVIOUS = "last.ckpt", "previous.ckpt"

BEST = "best"  # Key of the best weights and their score. Checkpoints of other programs do not have it

LARGEST = 10**11  # Largest size of a checkpoint, bytes

UNREADABLE = (
    UnpicklingError, RuntimeError, OSError, EOFError, ValueError, LookupError, TypeError, AttributeError,
    AssertionError, ArithmeticError, MemoryError, struct.error, BadZipFile, MisconfigurationException,
)  # fmt: skip
"""Errors that torch and Lightning raise on files that are damaged, hold more than plain data, or belong to another
training."""


def quiet_trainer(**settings: Any) -> L.Trainer:
    """Lightning's loop as every training uses it: with clipped gradients, and without messages and files of its own."""
    several = (settings.get("devices", 1), settings.get("num_nodes", 1)) != (1, 1)
    # A branch that is bypassed gets no gradient; this strategy of DDP allows that.
    where = {"accelerator": "auto", "devices": 1, "strategy": "ddp_find_unused_parameters_true" if several else "auto"}
    for name in ("lightning.pytorch", "lightning.fabric"):
        logging.getLogger(name).setLevel(logging.ERROR)
    warnings.filterwarnings("ignore", module="lightning")
    return L.Trainer(
        num_sanity_val_steps=0,
        gradient_clip_val=GRADIENT_NORM,
        enable_checkpointing=False,  # Lightning's own; ours is one of the callbacks
        enable_progress_bar=False,
        enable_model_summary=False,
        **{**where, **settings},
    )


def process_count(trainer: Mapping[str, Any], batch_size: int) -> int:
    """Number of processes, which share a batch, of a training where these arguments of Lightning's Trainer say."""
    for name in trainer:
        if name not in WHERE:
            raise ParameterError("trainer", f"expected some of {', '.join(WHERE)}, found {shown(name)}")
    try:
        found = quiet_trainer(**trainer, logger=False)
    except (MisconfigurationException, ValueError, TypeError, RuntimeError) as error:
        raise ParameterError(
            "trainer", f"expected arguments of Lightning's Trainer, found {shown(dict(trainer))} ({reason(error)})"
        ) from error
    count = found.num_devices * found.num_nodes
    if batch_size % count:
        raise ParameterError("batch_size", f"expected a multiple of the number of devices, {count}, found {batch_size}")
    return count


def is_first_process() -> bool:
    """Whether this is the first of the processes of a training."""
    return getattr(rank_zero_only, "rank", 0) == 0


@contextmanager
def interrupts() -> Iterator[None]:
    """Turn the end of Lightning's loop by SIGINT or SIGTERM, SystemExit of various statuses, into KeyboardInterrupt."""
    on_interrupt = signal.getsignal(signal.SIGINT)
    try:
        yield
    except SystemExit:
        signal.signal(signal.SIGINT, on_interrupt)
        raise KeyboardInterrupt from None


@contextmanager
def computing(precision: MatmulPrecision, on_one_thread: bool) -> Iterator[None]:
    """Multiply matrices of single precision with this precision, on one CPU thread if asked, and then as before."""
    before, threads = torch.get_float32_matmul_precision(), torch.get_num_threads()
    torch.set_float32_matmul_precision(precision)
    torch.set_num_threads(1 if on_one_thread else threads)
    try:
        yield
    finally:
        torch.set_float32_matmul_precision(before)
        torch.set_num_threads(threads)


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


def has_checkpoint(folder: Path) -> bool:
    """Whether a folder has a checkpoint to resume from."""
    return any((folder / name).exists() for name in (LAST, PREVIOUS))


def read_checkpoint(path: Path) -> dict[str, Any]:
    """Read a checkpoint without running any code that it may hold."""
    require_regular(path, "a checkpoint", LARGEST)
    try:
        with ZipFile(path) as archive:  # torch does not compare the checksums that it writes
            if archive.testzip() is not None or any(each.compress_type != ZIP_STORED for each in archive.infolist()):
                raise BadZipFile
        content = torch.load(path, map_location="cpu", weights_only=True)
    except UNREADABLE:  # torch's own message would advise the user to run the code in the file
        raise InputError(
            f"{path}: expected a checkpoint of plain data, found one that is damaged, or that could run code when read"
        ) from None
    if not isinstance(content, dict) or BEST not in content:
        raise InputError(f"{path}: expected a checkpoint of this version of bisplat, found one of another version")
    return content


class WholeFiles(CheckpointIO):
    """Lightning's access to the disk. It writes ``LAST`` atomically, keeps the one before as ``PREVIOUS``, and reads
    either."""

    def __init__(self) -> None:
        self._last_is_damaged = False

    def save_checkpoint(self, checkpoint: dict[str, Any], path: Any, storage_options: Any = None) -> None:
        """Write a checkpoint."""
        last = Path(path)
        last.parent.mkdir(parents=True, exist_ok=True)
        content = BytesIO()
        torch.save(checkpoint, content)
        if last.exists() and not self._last_is_damaged:  # a damaged one must not replace the good one before it
            os.replace(last, last.with_name(PREVIOUS))
        write_atomically(last, content.getbuffer())
        self._last_is_damaged = False
        sync_folder(last.parent)

    def load_checkpoint(
        self, path: Any, map_location: Callable | None = None, weights_only: bool | None = None
    ) -> dict[str, Any]:
        """Read the newest checkpoint that can be read, and say so on stderr if it is not the last one."""
        last = Path(path)
        faults: list[str] = []
        for file in (last, last.with_name(PREVIOUS)):
            if not file.exists():
                continue
            try:
                content = read_checkpoint(file)
            except InputError as error:
                faults.append(str(error))
                continue
            if faults:
                self._last_is_damaged = True
                if is_first_process():
                    say(f"{faults[0]}; training resumes from the checkpoint before it, {file.name}")
            return content
        raise InputError(
            f"{'; '.join(faults)}; there is no other checkpoint: move {last.parent} away to train from the start"
        )

    def remove_checkpoint(self, path: Any) -> None:
        """Remove nothing, since a path in a checkpoint could be that of any file."""


class StopsEarly(EarlyStopping):
    """Ends a training whose validation has not risen for so many validations, and one that is resumed after that."""

    def __init__(self, patience: int) -> None:
        # It counts at the end of the validation, before the checkpoint, which keeps the count, is written.
        how = {"check_finite": False, "check_on_train_epoch_end": False}
        super().__init__("validation_ssim", mode="max", patience=patience, **how)

    def on_train_start(self, trainer: L.Trainer, module: L.LightningModule) -> None:
        trainer.should_stop = self.wait_count >= self.patience

    def in_words(self, step: int, epochs: Sequence[int]) -> str:
        """Why a training with epochs of so many steps, each with a validation after it, stopped after ``step``."""
        ends = list(accumulate(epochs))
        best = ends[max(0, ends.index(step) - self.wait_count)]
        return f"stopped after {step:,} of {ends[-1]:,} steps: validation has not risen since step {best:,}"


class Checkpoints(Callback):
    """Keeps the weights of the best validation, and writes a checkpoint at the end of each epoch that was validated."""

    def __init__(self, path: Path):
        self._path, self._validated = path, False
        self.score, self.weights, self.restored = float("-inf"), dict[str, Tensor](), False

    def on_train_start(self, trainer: L.Trainer, module: L.LightningModule) -> None:
        self.restored = True

    def on_validation_end(self, trainer: L.Trainer, module: L.LightningModule) -> None:
        self._validated = True

    def on_train_epoch_end(self, trainer: L.Trainer, module: L.LightningModule) -> None:
        if self._validated:
            self._validated = False
            trainer.save_checkpoint(self._path)

    def on_save_checkpoint(self, trainer: L.Trainer, module: L.LightningModule, checkpoint: dict[str, Any]) -> None:
        score = float(trainer.callback_metrics["validation_ssim"])
        if score > self.score or not self.weights:
            self.score = score if math.isfinite(score) else -1.0  # the lowest SSIM
            self.weights = {name: value.cpu().clone() for name, value in checkpoint["state_dict"].items()}
        checkpoint[BEST] = {"validation_ssim": self.score, "weights": self.weights}

    def on_load_checkpoint(self, trainer: L.Trainer, module: L.LightningModule, checkpoint: dict[str, Any]) -> None:
        epochs = trainer.datamodule.epochs  # type: ignore[attr-defined]
        if sum(epochs[: checkpoint["epoch"] + 1]) != checkpoint["global_step"]:
            raise ValueError(f"{checkpoint['global_step']} steps after {checkpoint['epoch'] + 1} validations")
        self.score, self.weights = float(checkpoint[BEST]["validation_ssim"]), checkpoint[BEST]["weights"]
        expected = {name: value.shape for name, value in module.state_dict().items()}
        found = {name: value.shape for name, value in self.weights.items()}
        if found != expected:
            raise ValueError(f"best weights named {shown(list(found))}")
