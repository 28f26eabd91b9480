"""Predictions of a model at positions, in batches, written into one array of single precision or of grey levels."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import torch
from jaxtyping import Bool, Complex, Float, UInt8

from learn.models.base import SpectrumModel, as_complex
from scenes.files.errors import ParameterError, shown
from simulate.spectra.angular_grid import COLUMNS, ROWS
from simulate.spectra.spectrum import LARGEST_GREY

PREDICT_AT_ONCE = {"cpu": 16, "cuda": 1024}  # Number of positions per batch of a prediction, by type of device

RESPONSES_AT_ONCE = 4096
"""Number of element responses per batch on the CPU, if the spectra are those of responses and need no memory besides:
256 positions of 4 × 4 elements."""

DType = Literal["float32", "uint8"] | type[np.float32] | type[np.uint8] | np.dtype[Any]
"""Type of the numbers of predicted spectra, as NumPy takes it."""


@dataclass(frozen=True)
class Prediction:
    """A model's prediction at K transmitter positions.

    Attributes:
        spectra: [K, 90, 360] predicted spectra, min–max normalised: 0…1, float32; or grey levels 0…255, uint8, if these
            were asked for.
        responses: [K, elements] predicted element responses, complex64, up to one unknown common factor for each
            position. None: the model predicts no responses.
        band_responses: [K, elements, subcarriers] the same over the band of the dataset, with one common factor for all
            positions. None: the dataset has no band, or the model predicts no responses over it.
    """

    spectra: Float[np.ndarray, "K 90 360"] | UInt8[np.ndarray, "K 90 360"]
    responses: Complex[np.ndarray, "K elements"] | None
    band_responses: Complex[np.ndarray, "K elements subcarriers"] | None = None


def batches_for(
    model: SpectrumModel, positions: Float[np.ndarray, "K 3"], at_once: int
) -> Iterator[Float[torch.Tensor, "B 3"]]:
    """Positions in batches of at most ``at_once``, on the model's device."""
    for batch in torch.from_numpy(np.asarray(positions)).float().split(at_once):
        yield batch.to(model.region.device)


def checked_dtype(dtype: Any) -> np.dtype:
    """The type of numbers that a user asks for."""
    try:
        found = None if dtype is None else np.dtype(dtype)
    except (TypeError, ValueError):
        found = None
    if found not in (np.dtype(np.float32), np.dtype(np.uint8)):
        raise ParameterError("dtype", f"expected float32 (0 to 1) or uint8 (grey levels), found {shown(dtype)}")
    return found


def predict(model: SpectrumModel, positions: Float[np.ndarray, "K 3"]) -> Prediction:
    """Predict with a model on its own device, in batches of positions."""
    return predicted(model, positions, np.dtype(np.float32))[0]


def predicted(
    model: SpectrumModel, positions: Float[np.ndarray, "K 3"], dtype: np.dtype
) -> tuple[Prediction, Bool[np.ndarray, " K"]]:
    """As ``predict``, with the spectra's type of numbers, float32 or uint8; also which of the spectra are finite."""
    spectra, finite = np.empty((len(positions), ROWS, COLUMNS), dtype), np.ones(len(positions), bool)
    device = model.region.device.type
    at_once, beamformed = PREDICT_AT_ONCE[device], model.beamformed()
    if device == "cpu" and beamformed is not None:
        at_once = max(at_once, RESPONSES_AT_ONCE // beamformed.beamforming.elements)
    responses, over_band, start = [], [], 0
    with torch.inference_mode():
        for batch in batches_for(model, positions, at_once):
            some = slice(start, start + len(batch))
            start = some.stop
            response, finite[some] = _write(model, batch, spectra[some])
            if response is not None:
                responses.append(as_complex(response))
            of_band = model.band_responses(batch)
            if of_band is not None:
                over_band.append(as_complex(of_band))
    found = (np.concatenate(each) if each else None for each in (responses, over_band))
    return Prediction(spectra, *found), finite


def _write(
    model: SpectrumModel, positions: Float[torch.Tensor, "B 3"], spectra: np.ndarray
) -> tuple[Float[torch.Tensor, "B elements 2"] | None, Bool[np.ndarray, " B"]]:
    """Write the spectra of a batch into an array. Return the responses, if any, and which spectra are finite."""
    beamformed = model.beamformed()
    quick = None if beamformed is None else beamformed.beamforming.quick(positions)
    if beamformed is None or quick is None:
        found, responses = model.predict(positions)
        return responses, _write_numbers(found.cpu().numpy(), spectra)
    responses = beamformed.responses(positions)
    if beamformed.add_others is None:
        return responses, quick.write(as_complex(responses), spectra)
    mean = spectra if spectra.dtype == np.float32 else np.empty(spectra.shape, np.float32)
    quick.write(as_complex(responses), mean, beamformed.weight)
    beamformed.add_others(positions, mean)
    return responses, _write_numbers(mean, spectra)


def _write_numbers(numbers: Float[np.ndarray, "B 90 360"], spectra: np.ndarray) -> Bool[np.ndarray, " B"]:
    """Write numbers into an array, at least 0 and at most 1 (interpolated ones can be beyond), or as grey levels."""
    finite = np.ones(len(numbers), bool)
    for first in range(0, len(numbers), PREDICT_AT_ONCE["cpu"]):  # so few that they stay in a cache
        some = slice(first, first + PREDICT_AT_ONCE["cpu"])
        each = numbers[some]
        with np.errstate(over="ignore", invalid="ignore"):  # which are not finite is told
            whole = np.isfinite(each.sum(axis=(1, 2)))  # one pass, and a second one where a sum is not finite
            whole[~whole] = np.isfinite(each[~whole]).all(axis=(1, 2))
            finite[some] = whole
            if spectra.dtype == np.uint8:
                each = np.clip(each, 0, 1)
                each *= LARGEST_GREY
                each += 0.5
                spectra[some] = each
            else:
                unbounded = each[~whole]  # a copy, which shows what is wrong
                np.clip(each, 0, 1, out=spectra[some])
                spectra[some][~whole] = unbounded
    return finite


def uncertainty(model: SpectrumModel, positions: Float[np.ndarray, "K 3"]) -> Float[np.ndarray, " K"] | None:
    """Variances of predictions relative to the field's variance, 0…1. None: the model computes none."""
    found = []
    with torch.inference_mode():
        for batch in batches_for(model, positions, PREDICT_AT_ONCE[model.region.device.type]):
            variance = model.uncertainty(batch)
            if variance is None:
                return None
            found.append(variance.double().cpu().numpy())
    return np.concatenate(found)
