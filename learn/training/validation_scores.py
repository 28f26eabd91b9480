"""Score of a model on the validation part of its split, and how far its predictions are off there."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from learn.data.metrics import ssim_of_each
from learn.data.splits import Split
from learn.models.base import SpectrumModel
from learn.training.deviation import Deviation, fit_deviation, pixel_errors
from learn.training.lightning_module import Spectra
from learn.training.run_folder import predict, uncertainty
from simulate.dataset.dataset_folder import Dataset
from simulate.spectra.spectrum import evenly, spectrum_of


class Validation(NamedTuple):
    """Result of a model on validation spectra.

    Attributes:
        ssim: median SSIM; 0 if there are no validation spectra.
        deviation: how far predictions are off. None: there are too few spectra to tell.
    """

    ssim: float
    deviation: Deviation | None


def validate(model: SpectrumModel, dataset: Dataset, parts: Split) -> Validation:
    """Predict at most ``Spectra.VALIDATED`` validation spectra, to which the model was not fitted.

    Args:
        model: the model, fitted to ``parts.train``.
        dataset: the dataset.
        parts: its split.
    """
    validated = evenly(parts.validation, Spectra.VALIDATED)
    if not len(validated):
        return Validation(0.0, None)
    positions, truth = dataset.positions[validated], spectrum_of(dataset.pictures[validated])
    prediction = predict(model, positions).spectra
    error = pixel_errors(prediction, truth)
    return Validation(
        float(np.median(ssim_of_each(prediction, truth))), fit_deviation(error, uncertainty(model, positions))
    )
