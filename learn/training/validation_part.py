"""Validation: when and on which spectra, score and deviation there, and whether responses behind pictures pay."""

from __future__ import annotations

import time
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float, Int
from rich.console import Console

from learn.data.metrics import ssim_of_each
from learn.data.neighbours import inverse_distance
from learn.data.splits import Split
from learn.models.base import Report, SpectrumModel
from learn.models.capabilities import FitsInClosedForm, PredictsResponses
from learn.models.kriging.kriged_field import KrigedField
from learn.models.kriging.retrieved_field import can_retrieve, fit_to_pictures, retrieved_responses, with_contrast
from learn.models.model_settings import Steps
from learn.models.networks.response_network import ResponseNetwork
from learn.training.conformal_deviation import (
    LEAST_VALIDATED,
    Deviation,
    errors_over_gaps,
    fit_deviation,
    interpolates,
    knowing_nothing,
    nearest_known,
    pixel_errors,
)
from learn.training.fit_progress import FitProgress
from learn.training.prediction import predict, uncertainty
from scenes.files.plain_text import say
from simulate.dataset.dataset import Dataset
from simulate.spectra.spectrum import evenly, spectrum_of

STEPS_PER_VALIDATION, VALIDATIONS = 100, 15
"""Smallest number of steps between validations, and number of validations of a long training, which has more steps than
the product of both."""

VALIDATED = 128  # Largest number of validation spectra, evenly spread over the validation part


def epochs_of(steps: int) -> list[int]:
    """Number of steps between validations, for each validation; they add up to ``steps``."""
    validations = max(1, min(steps // STEPS_PER_VALIDATION, VALIDATIONS))
    each, more = divmod(steps, validations)
    return [each + 1] * more + [each] * (validations - more)


def validation_sample(part: Int[np.ndarray, " n"]) -> Int[np.ndarray, " v"]:
    """The spectra of a validation part on which models are validated."""
    return evenly(part, VALIDATED)


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


def fit_in_closed_form(model: SpectrumModel, dataset: Dataset, parts: Split) -> Validation:
    """Fit a model to the training part and score it on validation; then fit it to both with the same choices."""
    assert isinstance(model, FitsInClosedForm)
    with FitProgress(f"fit to the {len(parts.train)} training spectra") as model.report:
        found = model.fit(dataset, parts.train)
    validation = validate(model, dataset, parts)
    with FitProgress(f"fit to all {len(parts.known)} known spectra") as model.report:
        model.refit(dataset, parts.known)
    Console(stderr=True).print(f"bisplat: {found}", highlight=False, soft_wrap=True)
    told(validation.deviation, len(parts.validation))
    return validation


class Learned(NamedTuple):
    """What a network learns from."""

    # responses of every spectrum of the dataset, over its band if the network learns that. Those outside the training
    # part may be zero, and those behind black pictures are. None: the network learns from pictures.
    responses: Complex[np.ndarray, "K elements *subcarriers"] | None
    seconds: float = 0.0  # time that it took to find them, seconds


def learned_responses(model: SpectrumModel, dataset: Dataset, parts: Split, by_steps: Steps) -> Learned:
    """The responses from which a model learns, if there are any.

    Responses are found behind pictures if the model predicts some and ``by_steps.find_phases`` is set. They are used if
    kriging of them predicts the validation spectra better than inverse-distance weighting does.
    """
    if not isinstance(model, PredictsResponses):
        return Learned(None)
    if dataset.band is not None and isinstance(model, ResponseNetwork):
        return Learned(dataset.band_responses)
    if "response" in dataset.values:
        return Learned(dataset.responses)
    if not (by_steps.find_phases and len(parts.validation) and can_retrieve(dataset, parts.train)):
        return Learned(None)
    began = time.perf_counter()
    with FitProgress(f"phases of the {len(parts.train)} training pictures") as report:
        field, responses = _found(model, dataset, parts, report)
    validated = validation_sample(parts.validation)
    truth, places = spectrum_of(dataset.pictures[validated]), dataset.positions[validated]
    known = dataset.positions[parts.train], spectrum_of(dataset.pictures[parts.train])
    by_phases = float(np.median(ssim_of_each(predict(field, places).spectra, truth)))
    by_distance = float(np.median(ssim_of_each(inverse_distance(*known, places), truth)))
    pays = by_phases > by_distance
    say(
        f"the model learns from {'responses found behind the pictures' if pays else 'pictures'}: on validation "
        f"spectra, kriging of the responses has SSIM {by_phases:.3f}, inverse-distance weighting {by_distance:.3f}"
    )
    return Learned(responses if pays else None, time.perf_counter() - began)


def _found(
    model: SpectrumModel, dataset: Dataset, parts: Split, report: Report
) -> tuple[KrigedField, Complex[np.ndarray, "K elements"]]:
    """The field of responses behind the training pictures, and these responses; zero elsewhere."""
    region, wavelength = model.region.cpu().numpy(), dataset.wavelength
    of_spectra = KrigedField(region, dataset.beamformer, wavelength, "spectra")
    field = KrigedField(region, dataset.beamformer, wavelength, "responses")
    of_spectra.report = field.report = report  # type: ignore[method-assign]
    seen = with_contrast(dataset, parts.train)
    of_spectra.fit(dataset, seen)
    report("responses behind pictures", 0, 1)
    return field, fit_to_pictures(field, of_spectra, retrieved_responses(dataset, seen), dataset, seen)
