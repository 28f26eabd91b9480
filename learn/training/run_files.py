"""What a run folder records of its training (training.json, known_positions.csv), and the untrained model of a run."""

from __future__ import annotations

import datetime
import json
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import torch
from jaxtyping import Float
from msgspec import Meta, Struct, to_builtins

from learn.data.splits import Split
from learn.models.base import SpectrumModel
from learn.models.model_settings import STEPS_MOST
from learn.training.config import Config
from learn.training.conformal_deviation import Deviation
from learn.training.registry import check_options, model_class, model_entry
from scenes.files.atomic import write_atomically
from scenes.files.errors import InputError, reason, shown
from scenes.files.json_yaml_xml import read_json
from scenes.files.schema import conform
from scenes.scene.shapes import bounding_box
from simulate.dataset.dataset import Dataset
from simulate.positions.positions import read_points, write_positions
from simulate.spectra.beamformer import Beamformer

FILE, KNOWN = "training.json", "known_positions.csv"


def device_name() -> str:
    """Name of the GPU, or number of CPU threads, that this process trains on."""
    return torch.cuda.get_device_name() if torch.cuda.is_available() else f"{torch.get_num_threads()} CPU threads"


def write_training(
    folder: Path,
    steps: int,
    seconds: float,
    validation_ssim: float,
    deviation: Deviation | None,
    learned_from: Float[np.ndarray, "n 3"],
) -> None:
    """Write training.json and known_positions.csv."""
    write_positions(folder / KNOWN, learned_from)
    content: dict[str, Any] = {
        "steps": steps,
        "seconds": round(seconds, 1),
        "device": device_name(),
        "date": datetime.date.today().isoformat(),
        "validation_ssim": validation_ssim,
    }
    if deviation is not None:
        content["deviation"] = to_builtins(deviation)
    write_atomically(folder / FILE, (json.dumps(content, indent=2) + "\n").encode())


class TrainingFile(Struct, frozen=True):
    """The entries of training.json that are read."""

    steps: Annotated[int, Meta(ge=0, le=STEPS_MOST)]
    seconds: Annotated[float, Meta(ge=0)]
    deviation: Deviation | None = None


def read_training(folder: Path) -> TrainingFile:
    """Read training.json."""
    path = folder / FILE
    found = conform(read_json(path, "the steps and seconds of a training", nan=True), TrainingFile, str(path))
    stated = found.deviation
    if stated is not None and (len(stated.gaps) != len(stated.errors) or sorted(stated.gaps) != stated.gaps):
        raise InputError(
            f"{path}: expected as many ascending gaps as errors in deviation, found {shown(stated.gaps)} and "
            f"{shown(stated.errors)}"
        )
    return found


def read_known_positions(folder: Path) -> Float[np.ndarray, "n 3"]:
    """Positions of the spectra that the model of a run learned from, metres."""
    return read_points(folder / KNOWN)


def untrained_model(config: Config, dataset: Dataset, parts: Split) -> SpectrumModel:
    """The untrained model of a run, for a dataset and its split."""
    model = build_model(config, box_of(dataset.positions[parts.known]), dataset.beamformer, dataset.wavelength)
    model.adapt_to(dataset, parts.train)
    return model


def build_model(
    config: Config, region: Float[np.ndarray, "2 3"], beamformer: Beamformer, wavelength: float
) -> SpectrumModel:
    """Build the untrained model of a run."""
    check_options(config.model, config.options)
    build: Any = model_class(config.model)
    try:
        return build(region, beamformer, wavelength, **{**model_entry(config.model).options, **config.options})
    except InputError:
        raise
    except (ValueError, TypeError, ArithmeticError, AssertionError, RuntimeError, SystemExit) as error:
        raise InputError(
            f"model {config.model}: expected options that it can be built with, found {shown(config.options)} "
            f"({reason(error)})"
        ) from error


def box_of(positions: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "2 3"]:
    """Corners (min, max) of the bounding box of positions, metres. An extent below 1 mm becomes 1 mm."""
    low, high = bounding_box(positions)
    return np.stack([low, np.maximum(high, low + 1e-3)])
