"""Responses for a network to learn from: the dataset's own, or those found behind its pictures.

A model that predicts element responses learns more from these than from pictures, which lack the phases. If only
pictures are known, the responses behind the training pictures are found such that they form one field
(``learn.models.kriging.retrieved_field``). They are used only if kriging of them predicts the validation spectra well.
"""

from __future__ import annotations

import time
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex

from learn.baselines.neighbours import inverse_distance
from learn.data.metrics import ssim_of_each
from learn.data.splits import Split
from learn.models.base import Report, SpectrumModel
from learn.models.capabilities import LearnsBand, PredictsResponses
from learn.models.kriging.kriged_field import KrigedField
from learn.models.kriging.retrieved_field import can_retrieve, fit_to_pictures, retrieved_responses, with_contrast
from learn.models.model_settings import Steps
from learn.training.epochs import validation_sample
from learn.training.fit_progress import FitProgress
from learn.training.prediction import predict
from scenes.files.plain_text import say
from simulate.dataset.dataset import Dataset
from simulate.spectra.spectrum import spectrum_of


class Learned(NamedTuple):
    """What a network learns from."""

    # responses of every spectrum of the dataset, over its band if the network learns that. Those outside the training
    # part may be zero, and those behind black pictures are. None: the network learns from pictures.
    responses: Complex[np.ndarray, "K elements *subcarriers"] | None
    seconds: float = 0.0  # time that it took to find them, seconds


def learned_responses(model: SpectrumModel, dataset: Dataset, parts: Split, by_steps: Steps) -> Learned:
    """The responses from which a model learns, if there are any.

    Responses are found behind pictures if the model predicts responses, if ``by_steps.find_phases`` is set, and if
    there are neither too few training pictures nor too many. They are used if kriging of them predicts the validation
    spectra better than inverse-distance weighting does. On the measured sample this holds for the split ``files``, but
    not for ``blocked``.
    """
    if not isinstance(model, PredictsResponses):
        return Learned(None)
    if dataset.band_responses is not None and isinstance(model, LearnsBand):
        return Learned(dataset.band_responses)
    if dataset.responses is not None:
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
