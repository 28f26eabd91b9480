"""The ways by which spectra are interpolated between known ones, and a field of each way of kriging."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from learn.models.base import Report
from learn.models.kriging.kriged_field import KrigedField
from learn.models.kriging.one_field import OneField
from learn.models.kriging.retrieved_field import RetrievedOnce, can_retrieve, fit_to_pictures, with_contrast
from learn.models.kriging.smooth_field import SmoothField
from simulate.dataset.dataset import Dataset
from simulate.spectra.beamformer import Beamformer

WAYS = {
    "responses": "kriging of responses",
    "phases": "kriging of responses found from pictures",
    "spectra": "kriging of spectra",
    "smooth-spectra": "smooth kriging of spectra",
    "inverse-distance": "inverse-distance weighting",
    "field": "kriging of one field at the elements of all arrays",
}
"""Names of the ways of interpolation, for the user."""

OF_RESPONSES = "field", "responses", "phases"
"""Ways by which responses are interpolated."""


class Built(NamedTuple):
    """What every model is built with."""

    region: Float[np.ndarray, "2 3"]  # as for ``SpectrumModel``
    beamformer: Beamformer  # the dataset's array and grid
    wavelength: float  # metres


def kriging_ways(dataset: Dataset, known: Int[np.ndarray, " n"]) -> list[str]:
    """The ways of kriging that are worth a try, in this order."""
    if dataset.responses is not None:
        one_field = ["field"] if dataset.moving == "receiver" and dataset.array.elements > 1 else []
        return [*one_field, "responses", "spectra", "smooth-spectra"]
    return ["spectra", *(["phases"] if can_retrieve(dataset, known) else []), "smooth-spectra"]


def empty_field(way: str, built: Built) -> KrigedField:
    """A field of one way, without known spectra."""
    built = built._replace(region=built.region.copy())  # else the buffers of several fields would share memory
    if way == "smooth-spectra":
        return SmoothField(*built)
    if way == "field":
        return OneField(*built)
    return KrigedField(*built, "responses" if way in OF_RESPONSES else "spectra")


@dataclass(frozen=True)
class FieldFits:
    """Fits fields to known spectra of one dataset."""

    built: Built  # what the fields are built with
    dataset: Dataset  # a dataset; its responses are interpolated only if it has any
    retrieved: RetrievedOnce  # responses behind its pictures that were found before

    def fitted(
        self, way: str, known: Int[np.ndarray, " n"], report: Report, of_spectra: KrigedField | None = None
    ) -> KrigedField:
        """A field of one way, fitted to known spectra."""
        field = empty_field(way, self.built)
        field.report = report  # type: ignore[method-assign]
        if way != "phases":
            field.fit(self.dataset, known)
            return field
        seen = with_contrast(self.dataset, known)
        if of_spectra is None or len(seen) < len(known):
            of_spectra = self.fitted("spectra", seen, report)
        responses = self.retrieved.of(self.dataset, seen, report)
        fit_to_pictures(field, of_spectra, responses, self.dataset, seen)
        return field
