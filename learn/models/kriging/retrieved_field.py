"""Kriging of the element responses behind pictures. Their phases are found such that all responses form one field."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Complex, Float, Int

from learn.models.base import Report
from learn.models.kriging.kriged_field import KrigedField
from learn.models.kriging.phase_synchronisation import Covariance, synchronised
from simulate.dataset.dataset import Dataset
from simulate.spectra.element_array import uniform
from simulate.spectra.phase_retrieval import retrieve_responses
from simulate.spectra.spectrum import spectrum_of

LEAST_RETRIEVED, MOST_RETRIEVED = 20, 1500
"""Smallest and largest number of known pictures behind which responses are looked for. Fewer do not determine the
phases, and each takes about 20 milliseconds."""

LEAST_NUGGETS = (0.03, 1e-3)
"""Least nugget of the covariance with which phases are found, for the first and the second time. With a smaller one,
early errors spread."""


def retrieved_responses(dataset: Dataset, known: Int[np.ndarray, " n"]) -> Complex[np.ndarray, "n elements"]:
    """Responses behind known pictures, each up to a factor and the flip: those in the dataset if it has them."""
    if dataset.retrieved is not None and np.isfinite(dataset.retrieved[known]).all():
        return dataset.retrieved[known]
    return retrieve_responses(spectrum_of(dataset.pictures[known]), dataset.beamformer).responses


class RetrievedOnce:
    """Keeps the responses behind a dataset's pictures, so that those of each are found only once."""

    def __init__(self) -> None:
        self._found: tuple[Dataset, Complex[np.ndarray, "K elements"]] | None = None

    def of(self, dataset: Dataset, known: Int[np.ndarray, " n"], report: Report) -> Complex[np.ndarray, "n elements"]:
        if self._found is None or self._found[0] is not dataset:
            self._found = dataset, np.full((len(dataset.positions), dataset.array.elements), np.nan, complex)
        found = self._found[1]
        missing = known[np.isnan(found[known]).any(axis=1)]
        if len(missing):
            report("responses behind pictures", 0, 1)
            found[missing] = retrieved_responses(dataset, missing)
        return found[known]


def with_contrast(dataset: Dataset, known: Int[np.ndarray, " n"]) -> Int[np.ndarray, " m"]:
    """The pictures with several grey levels; one of a single level contains nothing about the field."""
    return known[np.ptp(dataset.pictures[known], axis=(1, 2)) > 0]


def can_retrieve(dataset: Dataset, known: Int[np.ndarray, " n"]) -> bool:
    """Whether responses can be found behind known pictures: neither too few nor too many, of a uniform planar array."""
    if dataset.array.elements < 2 or len(known) > MOST_RETRIEVED or not_retrieved(dataset) is not None:
        return False
    return len(with_contrast(dataset, known)) >= LEAST_RETRIEVED


def not_retrieved(dataset: Dataset) -> str | None:
    """Why no responses are looked for behind the pictures of a dataset without any; None: they are, or it has some."""
    if uniform(dataset.array) is not None or dataset.responses is not None or dataset.retrieved is not None:
        return None
    return (
        f"{dataset.folder}: no responses are looked for behind its pictures, since this needs a uniform planar array; "
        f"the dataset has {dataset.array.in_words}"
    )


def fit_to_pictures(
    field: KrigedField,
    of_spectra: KrigedField,
    responses: Complex[np.ndarray, "n elements"],
    dataset: Dataset,
    known: Int[np.ndarray, " n"],
) -> Complex[np.ndarray, "K elements"]:
    """Fit a field of responses to known pictures.

    The covariance of pictures, ``|κ|²``, shows from which directions waves come. With this κ, factors and flips are
    found that make the retrieved responses one field. Then κ is fitted to these, and both steps are repeated.
    """
    law, flips = of_spectra, uniform(dataset.array) is not None
    all_responses = np.zeros((len(dataset.positions), responses.shape[1]), complex)
    for least in LEAST_NUGGETS:
        positions = dataset.positions[known]
        responses = synchronised(responses, positions, _covariance(law), max(float(law.nugget), least), flips)
        all_responses[known] = responses
        field.fit(replace(dataset, responses=all_responses), known)
        law = field
    return all_responses


def _covariance(field: KrigedField) -> Covariance:
    """κ between the known positions of a fitted field."""
    places, times, directions, shares = (
        each.double().numpy() for each in (field.places, field.times, field.directions, field.shares)
    )
    waves = np.exp(2j * np.pi / float(field.wavelength) * places @ directions.T)
    length, drift = float(field.length), float(field.drift)

    def covariance(a: Int[np.ndarray, " a"], b: Int[np.ndarray, " b"]) -> Complex[np.ndarray, "a b"]:
        distance: Float[np.ndarray, "a b"] = np.linalg.norm(places[a][:, None] - places[b], axis=-1)
        apart = np.abs(times[a][:, None] - times[b])
        return (waves[a] * shares) @ waves[b].conj().T * np.exp(-distance / length - apart / drift)

    return covariance
