"""Training by gradient steps: loss, optimiser, schedule and batches. Lightning runs the loop and resumes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from datetime import timedelta
from pathlib import Path
from typing import Any

import lightning as L
import numpy as np
import torch
from jaxtyping import Complex, Float, Int, UInt8
from lightning.pytorch.callbacks import Timer
from lightning.pytorch.loggers import CSVLogger, TensorBoardLogger
from torch import Tensor
from torch.optim.lr_scheduler import CosineAnnealingLR, LinearLR, SequentialLR
from torch.utils.data import BatchSampler, DataLoader, Sampler, SequentialSampler, Subset, TensorDataset
from torch.utils.data.distributed import DistributedSampler

from learn.data.metrics import ssim_of_each
from learn.data.splits import Split
from learn.models.base import SpectrumModel
from learn.models.capabilities import HasOwnLoss, PredictsResponses
from learn.models.model_settings import Steps
from learn.models.quadrature import Quadrature, composite_loss
from learn.training.lightning_trainer import (
    LAST,
    UNREADABLE,
    Checkpoints,
    ProgressOnStderr,
    StopsEarly,
    WholeFiles,
    computing,
    has_checkpoint,
    interrupts,
    quiet_trainer,
)
from learn.training.run_files import write_training
from learn.training.run_folder import save_weights
from learn.training.validation_part import epochs_of, told, validate, validation_sample
from scenes.files.errors import InputError, printable
from scenes.files.plain_text import say
from simulate.dataset.dataset import Dataset
from simulate.spectra.spectrum import LARGEST_GREY, spectrum_of

LEAST_SECONDS = 1e-3  # A training that has so little time still makes one step

WARM_UP = 0.05  # Fraction of the steps during which the learning rate rises linearly to its full value


class Training(L.LightningModule):
    """Trains a model by AdamW, whose learning rate rises linearly and then falls to zero along half a cosine."""

    def __init__(self, model: SpectrumModel, by_steps: Steps, pixels: Quadrature):
        super().__init__()
        self.model, self.by_steps, self.pixels = model, by_steps, pixels
        self.coarse_steps = 0 if isinstance(model, HasOwnLoss) else by_steps.coarse_steps
        self._validation: list[np.ndarray] = []
        self._seed = torch.initial_seed()

    def training_step(self, batch: list[Tensor], _: int) -> Tensor:
        positions, pictures, responses = batch
        # Random draws depend only on the step, also after resuming. torch.manual_seed takes a millisecond longer: it
        # formats the stack for each absent kind of device.
        torch.default_generator.manual_seed(self._seed + self.global_step)
        if self.device.type == "cuda":
            torch.cuda.manual_seed(self._seed + self.global_step)
        loss = self.loss(positions, pictures, responses, coarse=self.global_step < self.coarse_steps)
        self.log("loss", loss, on_step=False, on_epoch=True, prog_bar=True, sync_dist=True)
        return loss

    def loss(
        self,
        positions: Float[Tensor, "B 3"],
        pictures: UInt8[Tensor, "B 90 360"],
        responses: Float[Tensor, "B elements *subcarriers 2"],
        coarse: bool,
    ) -> Tensor:
        """Loss of a batch: of responses if these are given and the model predicts them, otherwise of pictures."""
        if isinstance(self.model, PredictsResponses) and responses.shape[1]:
            return self.model.responses_loss(positions, responses)
        if coarse:
            few = pictures[:, self.pixels.rows][:, :, self.pixels.columns]
            return self.model.coarse_loss(positions, few.float() / LARGEST_GREY, self.pixels)
        spectra = pictures.float() / LARGEST_GREY
        if isinstance(self.model, HasOwnLoss):
            return self.model.training_loss(positions, spectra)
        return composite_loss(self.model(positions), spectra)

    def validation_step(self, batch: list[Tensor], _: int) -> None:
        positions, pictures = batch[:2]
        prediction = self.model(positions).float().cpu().numpy()
        self._validation.append(ssim_of_each(prediction, spectrum_of(pictures.cpu().numpy())))

    def on_validation_epoch_end(self) -> None:
        ssim_median = float(np.median(np.concatenate(self._validation)))
        self._validation.clear()
        self.log("validation_ssim", ssim_median, prog_bar=True)

    def configure_optimizers(self):
        steps, rate = self.by_steps.steps, self.by_steps.learning_rate
        optimiser = torch.optim.AdamW(self.model.groups(self.by_steps.weight_decay), lr=rate, fused=True)
        warm_up = max(1, round(WARM_UP * steps))
        rising = LinearLR(optimiser, start_factor=1 / warm_up, total_iters=warm_up - 1)
        falling = CosineAnnealingLR(optimiser, T_max=max(1, steps - warm_up))
        schedule = SequentialLR(optimiser, [rising, falling], milestones=[warm_up])
        return {"optimizer": optimiser, "lr_scheduler": {"scheduler": schedule, "interval": "step"}}


class Batches(Sampler[list[int]]):
    """Batches of indices: those numbered from ``first`` on of an endless row of passes over the training part."""

    def __init__(self, sampler: DistributedSampler, size: int, first: int, count: int):
        self._sampler, self._size, self._first, self._count = sampler, size, first, count

    def __len__(self) -> int:
        return self._count

    def __iter__(self) -> Iterator[list[int]]:
        drop_last = len(self._sampler) > self._size
        in_a_pass = len(BatchSampler(self._sampler, self._size, drop_last))
        number, last = self._first, self._first + self._count
        while number < last:
            done, begin = divmod(number, in_a_pass)
            self._sampler.set_epoch(done)
            batches = list(BatchSampler(self._sampler, self._size, drop_last))[begin : begin + last - number]
            yield from batches
            number += len(batches)


class Spectra(L.LightningDataModule):
    """Batches of (position, 8-bit picture, element responses of mean square magnitude 1, or none).

    Their order depends only on the seed, also in a resumed run and of several processes together.
    """

    # number of steps of each epoch; the model is validated after each. None: a single pass.
    epochs: Sequence[int] | None = None

    VALIDATED_AT_ONCE = 16  # Number of validation spectra in a batch

    def __init__(
        self,
        dataset: Dataset,
        parts: Split,
        batch_size: int,
        seed: int,
        responses: Complex[np.ndarray, "K elements *subcarriers"] | None = None,
    ):
        super().__init__()
        self.dataset, self.parts, self._batch_size, self._seed = dataset, parts, batch_size, seed
        self._responses = torch.zeros(len(dataset.positions), 0, 2)
        self.of_responses = responses is not None  # Their steps are so small that more than one thread is slower
        if responses is not None:
            scale = np.sqrt(np.square(np.abs(responses[parts.train])).mean())
            self._responses = torch.view_as_real(torch.from_numpy(responses / (scale or 1.0))).float()

    def train_dataloader(self) -> DataLoader:
        data, processes, rank, epoch = self._data(self.parts.train, not self.of_responses), 1, 0, 0
        if self.trainer is not None:
            processes, rank, epoch = self.trainer.world_size, self.trainer.global_rank, self.trainer.current_epoch
        lengths = self.epochs or [max(1, len(self.parts.train) // self._batch_size)]
        epoch = min(epoch, len(lengths) - 1)  # a finished training is resumed only to write its weights
        sampler: DistributedSampler = DistributedSampler(data, processes, rank, seed=self._seed, drop_last=True)
        batches = Batches(sampler, self._batch_size // processes, sum(lengths[:epoch]), lengths[epoch])
        return DataLoader(data, batch_size=None, sampler=batches)

    def val_dataloader(self) -> DataLoader:
        data = self._data(validation_sample(self.parts.validation))
        # Every process validates the same spectra, so that all get the same validation SSIM.
        batches = BatchSampler(SequentialSampler(data), self.VALIDATED_AT_ONCE, drop_last=False)
        return DataLoader(data, batch_size=None, sampler=batches)

    def _data(self, part: Int[np.ndarray, " n"], with_pictures: bool = True) -> Subset:
        """A part of the dataset's arrays. They are not copied, since the file behind them may be larger than memory."""
        positions = torch.from_numpy(self.dataset.positions.astype(np.float32))
        pictures = torch.from_numpy(self.dataset.pictures if with_pictures else self.dataset.pictures[:, :0])
        return Subset(TensorDataset(positions, pictures, self._responses), part.tolist())


def train_by_steps(
    model: SpectrumModel,
    spectra: Spectra,
    by_steps: Steps,
    pixels: Quadrature,
    folder: Path,
    trainer: Mapping[str, Any],
    seconds_before: float = 0.0,
    minutes: float | None = None,
) -> None:
    """Train a model by gradient steps, from the folder's last checkpoint if it has one, and save its weights.

    The training ends when its minutes, if they are given, are over.
    """
    spectra.epochs = epochs_of(by_steps.steps)
    last = folder / "checkpoints" / LAST
    resumed = has_checkpoint(last.parent)
    checkpoints = Checkpoints(last)
    stopping = [StopsEarly(by_steps.patience)] if by_steps.patience else []
    left = None if minutes is None else timedelta(seconds=max(60 * minutes - seconds_before, LEAST_SECONDS))
    timer = Timer(left)  # its state is in the checkpoint, so it includes the time before an interruption
    # Each start of a training gets a new log folder, since CSVLogger deletes a log that it finds.
    attempt = len(list(folder.glob("logs/version_*")))
    loop = quiet_trainer(
        max_epochs=len(spectra.epochs),
        reload_dataloaders_every_n_epochs=1,  # each epoch has its own number of steps
        use_distributed_sampler=False,  # Spectra shares the batches among the processes itself
        callbacks=[timer, ProgressOnStderr(by_steps.steps), checkpoints, *stopping],
        plugins=[WholeFiles()],
        logger=[
            CSVLogger(folder, name="logs", version=attempt),
            TensorBoardLogger(folder, name="logs", version=attempt),
        ],
        **trainer,
    )
    try:
        with interrupts(), computing(by_steps.matmul_precision, spectra.of_responses):
            loop.fit(
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
    if loop.is_global_zero:
        if stopping and loop.global_step < by_steps.steps:
            say(stopping[0].in_words(loop.global_step, spectra.epochs))
        model.load_state_dict({name.removeprefix("model."): value for name, value in checkpoints.weights.items()})
        data, parts = spectra.dataset, spectra.parts
        deviation = validate(model.eval(), data, parts).deviation
        told(deviation, len(parts.validation))
        seconds = seconds_before + timer.time_elapsed("train")
        write_training(folder, loop.global_step, seconds, checkpoints.score, deviation, data.positions[parts.train])
        save_weights(folder, model)
    loop.strategy.barrier()  # the other processes wait until the weights are written
