"""A run folder: everything needed to use a trained model again.

config.json          what was trained, on what, with which settings and versions
split.json           names of the training, validation and test spectra
weights.safetensors  the best checkpoint's weights; its presence says that training is finished
checkpoints/         best.ckpt and last.ckpt of Lightning, to resume from
logs/                CSV and TensorBoard
"""

from __future__ import annotations

import datetime
import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal

import numpy as np
import torch
from jaxtyping import Complex, Float
from safetensors.torch import load_file, save

from learn.models.base import SpectrumModel
from learn.models.bisplat import APERTURE, PLUS, BiSplatAperture, BiSplatWRF, Bypass, ModelSize
from learn.models.helmholtz import HelmholtzField
from learn.models.mlp import PictureMLP, ResponseMLP
from learn.models.nerf2 import NeRF2
from learn.models.swiftwrf import SwiftWRF
from learn.splits import Split, SplitKind
from scenes.atomic import write_atomically
from scenes.errors import InputError
from simulate.array import PlanarArray
from simulate.dataset import Dataset

ModelName = Literal[
    "helmholtz", "bisplat", "bisplat-plus", "bisplat-aperture", "mlp", "mlp-responses", "nerf2", "swiftwrf"
]

SIZES: dict[ModelName, ModelSize] = {"bisplat": ModelSize(), "bisplat-plus": PLUS, "bisplat-aperture": APERTURE}

OTHERS: dict[ModelName, Callable[..., SpectrumModel]] = {
    "helmholtz": HelmholtzField,
    "mlp": PictureMLP,
    "mlp-responses": ResponseMLP,
    "nerf2": NeRF2,
    "swiftwrf": SwiftWRF,
}
"""Interpolation in closed form, and peers; see docs/peers.md for what differs from the originals."""

LEARNING_RATE: dict[ModelName, float] = {
    "helmholtz": 1.0,  # takes no steps
    "bisplat": 2e-3,
    "bisplat-plus": 3e-4,
    "bisplat-aperture": 2e-3,
    "mlp": 1e-3,
    "mlp-responses": 1e-3,
    "nerf2": 8e-4,
    "swiftwrf": 1e-3,
}
"""Of AdamW, where none is given: the deep networks of BiSplat-WRF+ do not survive the small models' rate."""

PREDICT_AT_ONCE = {"cpu": 16, "cuda": 1024}
"""Positions per batch of a prediction."""


@dataclass(frozen=True)
class Config:
    """Settings of a run; the same settings on the same data give the same weights.

    Attributes:
        dataset: folder trained on, absolute.
        model: which model.
        split: how the test part is chosen.
        seed: of the initial weights and the order of the spectra.
        split_seed: of the split.
        steps: optimiser steps, rounded to whole epochs.
        batch_size: spectra per step.
        learning_rate: of AdamW, after warm-up.
        bypass: branches switched off (the paper's ablation).
        size: arguments (entries of ``ModelSize``) that differ from the model's own.
        train_size: train on so many of the training part, drawn at random; None: on all.
        init: folder of a finished run of the same model whose weights to begin with; None: random ones.
    """

    dataset: str
    model: ModelName
    split: SplitKind
    seed: int
    split_seed: int
    steps: int
    batch_size: int
    learning_rate: float
    bypass: tuple[Bypass, ...] = ()
    size: dict[str, int] = field(default_factory=dict)
    train_size: int | None = None
    init: str | None = None


def build_model(config: Config, region: Float[np.ndarray, "2 3"], array: PlanarArray) -> SpectrumModel:
    """The untrained model a configuration names."""
    if config.model in OTHERS:
        return OTHERS[config.model](region, array, **config.size)
    bypass, size = frozenset(config.bypass), replace(SIZES[config.model], **config.size)
    if config.model == "bisplat-aperture":
        return BiSplatAperture(size, region, array, bypass)
    return BiSplatWRF(size, region, bypass)


def write_config(folder: Path, config: Config, array: PlanarArray, split: Split, names: Sequence[str]) -> None:
    """Write config.json and split.json."""
    content = {
        **asdict(config),
        "array": asdict(array),
        "normalisation": "pictures are min-max normalised per spectrum; positions are scaled inside the model",
        "versions": {name: version(name) for name in ("bisplat-wrf", "torch", "lightning", "numpy")},
    }
    write_atomically(folder / "config.json", (json.dumps(content, indent=2) + "\n").encode())
    parts = {part: [names[i] for i in getattr(split, part)] for part in ("train", "validation", "test")}
    write_atomically(folder / "split.json", (json.dumps(parts, indent=1) + "\n").encode())


def read_config(folder: Path) -> tuple[Config, PlanarArray]:
    """Read config.json.

    Raises:
        InputError: no such file, or not what ``write_config`` writes.
    """
    path = folder / "config.json"
    if not path.is_file():
        raise InputError(f"{folder}: expected a run folder made by bisplat train, found no config.json in it")
    try:
        content: dict[str, Any] = json.loads(path.read_text())
        fields = {name: content[name] for name in Config.__dataclass_fields__}
        fields["bypass"] = tuple(fields["bypass"])
        return Config(**fields), PlanarArray(**content["array"])
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(f"{path}: expected the settings bisplat train writes, found {error!r}") from error


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


@dataclass(frozen=True)
class Run:
    """A trained model with its settings."""

    folder: Path
    config: Config
    array: PlanarArray
    model: SpectrumModel

    def predict(self, positions: Float[np.ndarray, "K 3"]) -> Prediction:
        """Predict the spectra, and the element responses where the model knows them, in one pass of the model.

        Args:
            positions: metres, in the frame of the dataset trained on.
        """
        return predict(self.model, positions)

    def split(self, dataset: Dataset) -> Split:
        """The spectra this run was trained, validated and tested on.

        Raises:
            InputError: the dataset lacks some of them.
        """
        parts = json.loads((self.folder / "split.json").read_text())
        where = {name: index for index, name in enumerate(dataset.names)}
        missing = [name for names in parts.values() for name in names if name not in where]
        if missing:
            raise InputError(
                f"{dataset.folder}: expected the dataset {self.folder} was trained on, found no spectrum {missing[0]}"
            )
        return Split(**{part: np.array([where[name] for name in names], dtype=int) for part, names in parts.items()})


def predict(model: SpectrumModel, positions: Float[np.ndarray, "K 3"]) -> Prediction:
    """Predict with a model on its own device, a few positions at a time."""
    device = model.region.device
    spectra, responses = [], []
    with torch.inference_mode():
        for batch in torch.from_numpy(positions).float().split(PREDICT_AT_ONCE[device.type]):
            spectrum, response = model.predict(batch.to(device))
            spectra.append(spectrum.float().cpu().numpy())
            if response is not None:
                responses.append(torch.view_as_complex(response.contiguous()).to(torch.complex64).cpu().numpy())
    return Prediction(np.concatenate(spectra), np.concatenate(responses) if responses else None)


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
    """Load a finished run's weights into a model, but keep the model's own region: positions are scaled by it.

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


def load_run(folder: Path) -> Run:
    """Load a trained run, onto the GPU where there is one.

    Raises:
        InputError: not a run folder, training is not finished, or the weights are not this model's.
    """
    config, array = read_config(folder)
    path = folder / "weights.safetensors"
    if not path.is_file():
        raise InputError(
            f"{folder}: expected a finished run, found no weights.safetensors; run its bisplat train again"
        )
    model = build_model(config, np.zeros((2, 3)), array)
    try:
        model.load_state_dict(load_file(path))
    except Exception as error:  # safetensors and torch raise their own kinds
        raise InputError(
            f"{path}: expected the weights of {config.model}, found {str(error).splitlines()[0]}"
        ) from error
    device = "cuda" if torch.cuda.is_available() else "cpu"
    return Run(folder, config, array, model.eval().to(device))
