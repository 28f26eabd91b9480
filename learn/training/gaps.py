"""Errors over gaps: known spectra that are predicted from those farther away than a radius.

They tell how predictions get worse with the distance from the known positions, without any spectrum far from them.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Literal

import numpy as np
import torch
from jaxtyping import Bool, Float, Int

from learn.models.base import SpectrumModel
from learn.models.kriging.deviation_curve import size_of
from learn.models.kriging.kriged_field import KrigedField
from learn.training.deviation import Gaps, pixel_errors
from learn.training.prediction import predict, uncertainty
from simulate.dataset.dataset import Dataset
from simulate.spectra.spectrum import evenly, spectrum_of

RADII = (0.0, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 5.0)
"""Radii within which known spectra are left out, wavelengths."""

MEMBERS = 30
"""Number of known spectra that are predicted for each radius."""

LEAST_LEFT = 8
"""A prediction from fewer spectra than this tells nothing."""

REFERENCE = 400
"""Largest number of spectra of the field that stands for a model without one of its own."""

UNRELATED = 1.0
"""Spectra at least this far apart are unrelated, wavelengths."""


def errors_over_gaps(model: SpectrumModel, dataset: Dataset, train: Int[np.ndarray, " n"]) -> Gaps | None:
    """Predict known spectra from those that are farther away than a radius, and measure the errors.

    A model that interpolates (``helmholtz``, ``twin``, ``mirror-images``) does so itself. Any other model would have to
    be trained again for each radius, so kriging stands for it.
    """
    if len(train) <= LEAST_LEFT:
        return None
    own = interpolates(model) and uncertainty(model, dataset.positions[train[:1]]) is not None
    if not own:
        train = evenly(train, REFERENCE)
        region, beamformer = model.region.cpu().numpy(), dataset.beamformer
        of: Literal["responses", "spectra"] = "spectra" if dataset.responses is None else "responses"
        model = KrigedField(region, beamformer, dataset.wavelength, of)
        model.fit(dataset, train)
    positions, wavelength = dataset.positions[train], dataset.wavelength
    members = evenly(np.arange(len(train)), MEMBERS)
    truth = spectrum_of(dataset.pictures[train[members]])
    found: list[tuple[float, float]] = []
    for radius in RADII:
        for member, true in zip(members, truth, strict=True):
            place = positions[member : member + 1]
            distance = np.linalg.norm(positions - place, axis=1)
            kept = distance > radius * wavelength + 1e-9
            if np.count_nonzero(kept) < LEAST_LEFT:
                continue
            with _without(model, place, radius * wavelength + 1e-9):
                error = size_of(pixel_errors(predict(model, place).spectra, true[None]))
                own_variance = uncertainty(model, place) if own else None
            gap = distance[kept].min() / wavelength if own_variance is None else own_variance[0]
            found.append((float(gap), float(error[0])))
    if not found:
        return None
    gap, error = np.array(found).T
    return Gaps("variance" if own else "distance", gap, error)


def knowing_nothing(
    prediction: Float[np.ndarray, "V 90 360"],
    places: Float[np.ndarray, "V 3"],
    dataset: Dataset,
    train: Int[np.ndarray, " n"],
) -> float:
    """The deviation of predictions from spectra that they have nothing to do with."""
    train = evenly(train, 4 * MEMBERS)
    truth = spectrum_of(dataset.pictures[train])
    sizes = []
    for spectrum, place in zip(prediction, places, strict=True):
        distance = np.linalg.norm(dataset.positions[train] - place, axis=1)
        far = np.flatnonzero(distance >= min(UNRELATED * dataset.wavelength, distance.max()))
        sizes.append(size_of(pixel_errors(np.broadcast_to(spectrum, truth[far].shape), truth[far]).ravel()))
    return float(np.sqrt(np.mean(np.square(sizes))))


def interpolates(model: SpectrumModel) -> bool:
    """Whether a model interpolates known spectra, so that it can do so without some of them."""
    return bool(_fields(model))


def _fields(model: SpectrumModel) -> list[KrigedField]:
    return [each for each in model.modules() if isinstance(each, KrigedField) and len(each.places)]


@contextmanager
def _without(model: SpectrumModel, place: Float[np.ndarray, "1 3"], radius: float) -> Iterator[None]:
    """Let a model interpolate without the known spectra within a radius of a place (metres) for a moment."""
    fields = _fields(model)
    before = [(field.places, field.times, field.values) for field in fields]
    try:
        for field, each in zip(fields, before, strict=True):
            centre = torch.from_numpy(place).to(field.places)
            kept: Bool[torch.Tensor, " n"] = torch.linalg.vector_norm(field.places - centre, dim=1) > radius
            field.places, field.times, field.values = (buffer[kept] for buffer in each)
        yield
    finally:
        for field, (places, times, values) in zip(fields, before, strict=True):
            field.places, field.times, field.values = places, times, values
