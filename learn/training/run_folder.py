"""A run folder: everything needed to use a trained model again.

config.json          what was trained, on what, with which settings and versions
split.json           names of the training, validation and test spectra
weights.safetensors  the best checkpoint's weights; once it is there, training is finished
training.json        steps, seconds, device, date, validation SSIM
checkpoints/         best.ckpt and last.ckpt of Lightning, to resume from
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
from simulate.array import PlanarArray
from simulate.dataset import Dataset, read_dataset

PREDICT_AT_ONCE = {"cpu": 16, "cuda": 1024}
"""Positions per batch of a prediction."""


def build_model(config: Config, region: Float[np.ndarray, "2 3"], array: PlanarArray) -> SpectrumModel:
    """The untrained model that a configuration names.

    Args:
        config: its ``model`` and ``options`` are used.
        region: corners (min, max) of the box of training positions, metres.
        array: the gateway's array.

    Raises:
        ParameterError: no such model, or an option that the model does not have.
    """
    check_options(config.model, config.options)
    build: Any = model_class(config.model)
    return build(region, array, **{**model_entry(config.model).options, **config.options})


@dataclass(frozen=True)
class Prediction:
    """What a model says of K transmitter positions.

    Attributes:
        spectra: predicted spectra, min–max normalised, 0…1.
        responses: complex element responses, each up to one unknown common factor; None where the model predicts
            spectra alone.
    """

    spectra: Float[np.ndarray, "K 90 360"]
    responses: Complex[np.ndarray, "K elements"] | None


def predict(model: SpectrumModel, positions: Float[np.ndarray, "K 3"]) -> Prediction:
    """Predict with a model on its own device, a few positions at a time.

    Args:
        model: any model.
        positions: metres, in the frame of the dataset the model was trained on.
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
        folder: where it was read from.
        config: what it was trained with.
        array: the gateway's array.
        model: the trained model, in evaluation mode, on the GPU where there is one.

    >>> import bisplat
    >>> run = bisplat.load_run("runs/lab")
    >>> run.config.model, run.predict([[2.5, 3.0, 1.2]]).spectra.shape
    ('helmholtz', (1, 90, 360))
    """

    folder: Path
    config: Config
    array: PlanarArray
    model: SpectrumModel

    @property
    def name(self) -> str:
        """The folder's own name, for tables and pages."""
        return self.folder.resolve().name

    def predict(self, positions: Float[np.ndarray, "K 3"]) -> Prediction:
        """Predict the spectra, and the element responses where the model knows them, in one pass of the model.

        Args:
            positions: metres, in the frame of the dataset trained on.
        """
        return predict(self.model, positions)

    def dataset(self) -> Dataset:
        """The dataset trained on, read from its folder.

        Raises:
            InputError: the folder is not there any more, or is not valid.
        """
        return read_dataset(self.config.dataset)

    def split(self, dataset: Dataset) -> Split:
        """The spectra this run was trained, validated and tested on.

        Raises:
            InputError: the dataset lacks some of them.
        """
        parts = json.loads((self.folder / "split.json").read_text())
        index_of = {name: index for index, name in enumerate(dataset.names)}
        missing = [name for names in parts.values() for name in names if name not in index_of]
        if missing:
            raise InputError(
                f"{dataset.folder}: expected the dataset {self.folder} was trained on, found no spectrum {missing[0]}"
            )
        return Split(**{part: np.array([index_of[name] for name in names], dtype=int) for part, names in parts.items()})


def device_name() -> str:
    """What this process trains on, for a reader."""
    return torch.cuda.get_device_name() if torch.cuda.is_available() else f"{torch.get_num_threads()} CPU threads"


def write_training(folder: Path, steps: int, seconds: float, validation_ssim: float) -> None:
    """Write training.json: what training took, and the validation SSIM of the weights kept."""
    content = {
        "steps": steps,
        "seconds": round(seconds, 1),
        "device": device_name(),
        "date": datetime.date.today().isoformat(),
        "validation_ssim": validation_ssim,
    }
    write_atomically(folder / "training.json", (json.dumps(content, indent=2) + "\n").encode())


def save_weights(folder: Path, model: SpectrumModel) -> None:
    """Write weights.safetensors."""
    tensors = {name: tensor.detach().cpu().contiguous() for name, tensor in model.state_dict().items()}
    write_atomically(folder / "weights.safetensors", save(tensors))


def load_weights(model: SpectrumModel, folder: Path) -> None:
    """Load a finished run's weights into a model, except the region, by which positions are scaled.

    Raises:
        InputError: no finished run, or one of another model.
    """
    source = load_run(folder).model.state_dict()
    try:
        model.load_state_dict({**source, "region": model.region})
    except RuntimeError as error:
        raise InputError(
            f"{folder}: expected a run of the same model and size, found {str(error).splitlines()[-1].strip()}"
        ) from error


def load_run(folder: Path | str) -> Run:
    """Load a trained run, onto the GPU where there is one.

    Raises:
        InputError: not a run folder, training is not finished, or the weights are not this model's.

    >>> import bisplat
    >>> bisplat.load_run("runs/lab").array
    PlanarArray(rows=4, columns=4, spacing=0.5)
    """
    folder = Path(folder)
    config, array = read_config(folder)
    path = folder / "weights.safetensors"
    if not path.is_file():
        raise InputError(
            f"{folder}: expected a finished run, found no weights.safetensors; run its bisplat train again"
        )
    model = build_model(config, np.zeros((2, 3)), array)
    try:
        model.load_state_dict(load_file(path))
    except (SafetensorError, RuntimeError) as error:
        raise InputError(
            f"{path}: expected the weights of {config.model}, found {str(error).splitlines()[0]}"
        ) from error
    device = "cuda" if torch.cuda.is_available() else "cpu"
    return Run(folder, config, array, model.eval().to(device))
