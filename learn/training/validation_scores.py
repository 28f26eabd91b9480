"""Score of a model on the validation part of its split, and how far its predictions are off there."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from learn.data.metrics import ssim_of_each
from learn.data.splits import Split
from learn.models.base import SpectrumModel
from learn.training.deviation import LEAST_VALIDATED, Deviation, fit_deviation, nearest_known, pixel_errors
from learn.training.epochs import validation_sample
from learn.training.gaps import errors_over_gaps, interpolates, knowing_nothing
from learn.training.prediction import predict, uncertainty
from scenes.files.plain_text import say
from simulate.dataset.dataset import Dataset
from simulate.spectra.spectrum import spectrum_of


class Validation(NamedTuple):
    """Result of a model on validation spectra."""

    ssim: float  # median SSIM; 0 if there are no validation spectra
    deviation: Deviation | None  # how far predictions are off. None: there are too few spectra to tell.


def validate(model: SpectrumModel, dataset: Dataset, parts: Split) -> Validation:
    """Predict at most ``VALIDATED`` validation spectra, to which the model was not fitted."""
    validated = validation_sample(parts.validation)
    if not len(validated):
        return Validation(0.0, None)
    positions, truth = dataset.positions[validated], spectrum_of(dataset.pictures[validated])
    prediction = predict(model, positions).spectra
    return Validation(
        float(np.median(ssim_of_each(prediction, truth))), _deviation(model, dataset, parts, validated, prediction)
    )


def _deviation(
    model: SpectrumModel,
    dataset: Dataset,
    parts: Split,
    validated: Int[np.ndarray, " V"],
    prediction: Float[np.ndarray, "V 90 360"],
) -> Deviation | None:
    """The deviation of the model's predictions. None: there are too few validation spectra."""
    if len(validated) < LEAST_VALIDATED:
        return None
    positions = dataset.positions[validated]
    error = pixel_errors(prediction, spectrum_of(dataset.pictures[validated]))
    nothing = knowing_nothing(prediction, positions, dataset, parts.train)
    variance = uncertainty(model, positions)
    if variance is not None and not interpolates(model):  # the user's own model states it
        return fit_deviation(error, variance, "variance", ([0.0, 1.0], [0.0, 1.0]), nothing)
    gaps = errors_over_gaps(model, dataset, parts.train)
    by_variance = gaps is not None and gaps.over == "variance"
    nearest = nearest_known(dataset.positions[parts.train], positions, dataset.wavelength)
    gap = variance if by_variance else nearest
    return fit_deviation(error, gap) if gaps is None else fit_deviation(error, gap, gaps.over, gaps.curve(), nothing)


def told(deviation: Deviation | None, validated: int) -> None:
    """Say what the validation spectra told about the deviation of predictions."""
    if deviation is None:
        say(
            f"this run states no deviation of its predictions: {validated} validation spectra cannot tell it, "
            f"{LEAST_VALIDATED} can"
        )
    else:
        say(deviation.facts())
