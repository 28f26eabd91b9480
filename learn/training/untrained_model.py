"""An untrained model, from the settings of a run and what its dataset tells: region, array, grid and wavelength."""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import Float

from learn.data.splits import Split
from learn.models.base import SpectrumModel
from learn.models.capabilities import suit_to
from learn.training.config import Config
from learn.training.registry import check_options, model_class, model_entry
from scenes.files.errors import InputError, reason, shown
from scenes.scene.shapes import bounding_box
from simulate.dataset.dataset import Dataset
from simulate.spectra.beamformer import Beamformer


def untrained_model(config: Config, dataset: Dataset, parts: Split) -> SpectrumModel:
    """The untrained model of a run, for a dataset and its split."""
    model = build_model(config, box_of(dataset.positions[parts.known]), dataset.beamformer, dataset.wavelength)
    suit_to(model, dataset, parts.train)
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
    except (ValueError, TypeError, ArithmeticError, AssertionError, RuntimeError) as error:
        raise InputError(
            f"model {config.model}: expected options that it can be built with, found {shown(config.options)} "
            f"({reason(error)})"
        ) from error


def box_of(positions: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "2 3"]:
    """Corners (min, max) of the bounding box of positions, metres. An extent below 1 mm becomes 1 mm."""
    low, high = bounding_box(positions)
    return np.stack([low, np.maximum(high, low + 1e-3)])
