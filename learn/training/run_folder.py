"""A run folder, which holds everything that is needed to use a trained model.

config.json          settings, the model's ``options``, the settings ``by_steps`` of training, array, grid, versions
split.json           names of the training, validation and test spectra
weights.safetensors  weights of the best checkpoint; the training is finished if this file exists
training.json        steps, seconds, device, date, validation SSIM
checkpoints/         last.ckpt and previous.ckpt, from which a training resumes (``learn.training.checkpoints``)
logs/                CSV and TensorBoard
"""

from __future__ import annotations

import datetime
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from jaxtyping import Complex, Float
from safetensors import SafetensorError
from safetensors.torch import load_file, save

from learn.models.base import SpectrumModel
from learn.models.registry import check_options, model_class, model_entry
from learn.splits import Split
from learn.training.config import Config, read_config
from scenes.atomic import write_atomically
from scenes.errors import InputError
from simulate.beamformer import Beamformer
from simulate.dataset import Dataset, read_dataset

PREDICT_AT_ONCE = {"cpu": 16, "cuda": 1024}
"""Number of positions per batch of a prediction, by type of device."""


def build_model(
    config: Config, region: Float[np.ndarray, "2 3"], beamformer: Beamformer, wavelength: float
) -> SpectrumModel:
    """Build the untrained model of a run.

    Args:
        config: settings of the run, of which ``model`` and ``options`` are used.
        region: corners (min, max) of the box of training positions, metres, world frame.
        beamformer: the dataset's array and grid.
        wavelength: metres.

    Raises:
        ParameterError: the model is unknown, or does not have one of the options.
    """
    check_options(config.model, config.options)
    build: Any = model_class(config.model)
    return build(region, beamformer, wavelength, **{**model_entry(config.model).options, **config.options})


@dataclass(frozen=True)
class Prediction:
    """A model's prediction for K transmitter positions.

    Attributes:
        spectra: predicted spectra, min–max normalised, 0…1.
        responses: predicted element responses, up to one unknown common factor per position; None: the model predicts
            no responses.
    """

    spectra: Float[np.ndarray, "K 90 360"]
    responses: Complex[np.ndarray, "K elements"] | None


def predict(model: SpectrumModel, positions: Float[np.ndarray, "K 3"]) -> Prediction:
    """Predict with a model on its own device, in batches of positions.

    Args:
        model: any model.
        positions: transmitter positions, metres, in the world frame of the dataset that the model was trained on.
    """
    device = model.region.device
    spectra, responses = [], []
    with torch.inference_mode():
        for batch in torch.from_numpy(np.asarray(positions)).float().split(PREDICT_AT_ONCE[device.type]):
            spectrum, response = model.predict(batch.to(device))
            spectra.append(spectrum.float().cpu().numpy())
            if response is not None:
                responses.append(torch.view_as_complex(response.contiguous()).to(torch.complex64).cpu().numpy())
    return Prediction(np.concatenate(spectra), np.concatenate(responses) if responses else None)


@dataclass(frozen=True)
class Run:
    """A trained model with its settings.

    Attributes:
        folder: the run folder.
        config: settings of the run.
        beamformer: the dataset's array and grid.
        model: the trained model, in evaluation mode, on the GPU if there is one.

    >>> import bisplat
    >>> run = bisplat.load_run("runs/lab")
    >>> run.config.model, run.predict([[2.5, 3.0, 1.2]]).spectra.shape
    ('helmholtz', (1, 90, 360))
    """

    folder: Path
    config: Config
    beamformer: Beamformer
    model: SpectrumModel

    @property
    def name(self) -> str:
        """Name of the run folder without its parents, for tables and pages."""
        return self.folder.resolve().name

    def predict(self, positions: Float[np.ndarray, "K 3"]) -> Prediction:
        """Predict spectra, and element responses if the model predicts them.

        Args:
            positions: transmitter positions, metres, in the world frame of the dataset of this run.
        """
        return predict(self.model, positions)

    def dataset(self) -> Dataset:
        """The dataset of this run, read from its folder.

        Raises:
            InputError: the folder does not exist any more, or is not valid.
        """
        return read_dataset(self.config.dataset)

    def split(self, dataset: Dataset) -> Split:
        """The spectra that this run was trained, validated and tested on.

        Args:
            dataset: the dataset of this run.

        Raises:
            InputError: the dataset lacks some of these spectra.
        """
        parts = json.loads((self.folder / "split.json").read_text())
        index_of = {name: index for index, name in enumerate(dataset.names)}
        missing = [name for names in parts.values() for name in names if name not in index_of]
        if missing:
            raise InputError(
                f"{dataset.folder}: expected the dataset that {self.folder} was trained on, found no spectrum "
                f"{missing[0]}"
            )
        return Split(**{part: np.array([index_of[name] for name in names], dtype=int) for part, names in parts.items()})


def device_name() -> str:
    """Name of the GPU, or number of CPU threads, that this process trains on."""
    return torch.cuda.get_device_name() if torch.cuda.is_available() else f"{torch.get_num_threads()} CPU threads"


def write_training(folder: Path, steps: int, seconds: float, validation_ssim: float) -> None:
    """Write training.json.

    Args:
        folder: the run folder.
        steps: number of optimiser steps.
        seconds: training time, seconds.
        validation_ssim: median SSIM on the validation part of the weights that are kept.
    """
    content = {
        "steps": steps,
        "seconds": round(seconds, 1),
        "device": device_name(),
        "date": datetime.date.today().isoformat(),
        "validation_ssim": validation_ssim,
    }
    write_atomically(folder / "training.json", (json.dumps(content, indent=2) + "\n").encode())


def save_weights(folder: Path, model: SpectrumModel) -> None:
    """Write weights.safetensors.

    Args:
        folder: the run folder.
        model: the trained model.
    """
    tensors = {name: tensor.detach().cpu().contiguous() for name, tensor in model.state_dict().items()}
    write_atomically(folder / "weights.safetensors", save(tensors))


def load_weights(model: SpectrumModel, folder: Path) -> None:
    """Load the weights of a finished run into a model, which keeps its own region for scaling positions.

    Args:
        model: a model of the same class and size.
        folder: folder of the finished run.

    Raises:
        InputError: the folder is no finished run, or one of another model or size.
    """
    source = load_run(folder).model.state_dict()
    try:
        model.load_state_dict({**source, "region": model.region})
    except RuntimeError as error:
        raise InputError(
            f"{folder}: expected a run of the same model and size, found {str(error).splitlines()[-1].strip()}"
        ) from error


def load_run(folder: Path | str) -> Run:
    """Load a finished run, onto the GPU if there is one.

    Args:
        folder: the run folder.

    Raises:
        InputError: the folder is not a run folder, its training is not finished, or the weights are another model's.

    >>> import bisplat
    >>> bisplat.load_run("runs/lab").beamformer.array
    PlanarArray(rows=4, columns=4, spacing=0.5)
    """
    folder = Path(folder)
    config, beamformer = read_config(folder)
    path = folder / "weights.safetensors"
    if not path.is_file():
        raise InputError(
            f"{folder}: expected a finished run, found no weights.safetensors; the same bisplat train again finishes it"
        )
    model = build_model(config, np.zeros((2, 3)), beamformer, 1.0)  # the weights have the region and the wavelength
    try:
        model.load_state_dict(load_file(path))
    except (SafetensorError, RuntimeError) as error:
        raise InputError(
            f"{path}: expected the weights of {config.model}, found {str(error).splitlines()[0]}"
        ) from error
    device = "cuda" if torch.cuda.is_available() else "cpu"
    return Run(folder, config, beamformer, model.eval().to(device))
