"""Kriging of the element responses behind pictures, whose phases are found such that they are one field."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Complex, Float, Int

from learn.models.kriged_field import KrigedField
from learn.models.phase_synchronisation import Covariance, synchronised
from simulate.dataset.dataset_folder import Dataset
from simulate.spectra.phase_retrieval import retrieve_responses
from simulate.spectra.spectrum import spectrum_of

LEAST_RETRIEVED, MOST_RETRIEVED = 20, 1500
"""Smallest and largest number of known pictures whose responses are found: fewer do not determine the phases, and each
takes about 20 milliseconds."""

LEAST_NUGGETS = (0.03, 1e-3)
"""Least nugget of the covariance by which phases are found, the first time and the second: with a smaller one, early
errors spread."""


def retrieved_responses(dataset: Dataset, known: Int[np.ndarray, " n"]) -> Complex[np.ndarray, "n elements"]:
    """Responses behind known pictures, each up to a factor and the flip; those of the dataset where it has them.

    Args:
        dataset: the dataset.
        known: indices of the pictures.
    """
    if dataset.retrieved is not None and np.isfinite(dataset.retrieved[known]).all():
        return dataset.retrieved[known]
    return retrieve_responses(spectrum_of(dataset.pictures[known]), dataset.beamformer).responses


def not_black(dataset: Dataset, known: Int[np.ndarray, " n"]) -> Int[np.ndarray, " m"]:
    """The indices of the pictures that are not black: a black one says nothing of the field."""
    return known[dataset.pictures[known].any(axis=(1, 2))]


def can_retrieve(dataset: Dataset, known: Int[np.ndarray, " n"]) -> bool:
    """Whether known pictures are enough, and not too many, for the responses behind them to be found.

    Args:
        dataset: the dataset.
        known: indices of the pictures.
    """
    if dataset.array.elements < 2 or len(known) > MOST_RETRIEVED:
        return False
    return len(not_black(dataset, known)) >= LEAST_RETRIEVED


def fit_to_pictures(
    field: KrigedField,
    of_spectra: KrigedField,
    responses: Complex[np.ndarray, "n elements"],
    dataset: Dataset,
    known: Int[np.ndarray, " n"],
) -> Complex[np.ndarray, "K elements"]:
    """Fit a field of responses to known pictures.

    The covariance of pictures, |κ|², says from which directions waves come. With this κ the factors and flips are found
    by which the retrieved responses are one field. κ is then fitted to these responses, and both steps are done again.
    The field is that of the true responses up to a common factor, and to a flip of all, which no picture can tell; its
    spectra do not depend on these.

    Args:
        field: interpolates responses; it is fitted.
        of_spectra: interpolates spectra, and is fitted to the same pictures.
        responses: of ``retrieved_responses``.
        dataset: the dataset.
        known: indices of the pictures, ascending, none of them black.

    Returns:
        The responses of all K spectra of the dataset that the field is fitted to; those of the others are zero.
    """
    law = of_spectra
    all_responses = np.zeros((len(dataset.positions), responses.shape[1]), complex)
    for least in LEAST_NUGGETS:
        positions = dataset.positions[known]
        responses = synchronised(responses, positions, _covariance(law), max(float(law.nugget), least))
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
