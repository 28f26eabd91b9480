"""The interpolators that are mixed: their names, and a fitted field for each way of kriging."""

from __future__ import annotations

from functools import partial

import numpy as np
import torch
from jaxtyping import Float, Int
from scipy.spatial.transform import Rotation
from torch import Tensor

from learn.models.base import Region, Report
from learn.models.kriging.kriged_field import KrigedField
from learn.models.kriging.retrieved_field import can_retrieve, fit_to_pictures, retrieved_responses, with_contrast
from learn.models.kriging.vecchia import fit_covariance
from learn.models.kriging.wave_covariance import Separations
from simulate.dataset.dataset import Dataset
from simulate.spectra.array import PlanarArray
from simulate.spectra.beamformer import Beamformer


class SquaredExponentialField(KrigedField):
    """Kriging of spectra by the squared exponential ``e^(−|Δ|²/2ℓ²)``, where nothing can follow the waves."""

    neighbours = 64

    def __init__(self, region: Region, beamformer: Beamformer, wavelength: float):
        super().__init__(region, beamformer, wavelength, "spectra")

    @property
    def first_length(self) -> float:
        """A tenth of the known positions' largest extent, but at least 0.1 mm; in metres."""
        return max(float((self.places.amax(dim=0) - self.places.amin(dim=0)).max()), 1e-3) / 10

    def kappa(
        self,
        separations: Separations,
        fading: Float[Tensor, "*b n m"],
        shares: Float[Tensor, " J"],
        length: Float[Tensor, ""],
    ) -> tuple[Float[Tensor, "*b n m"], None]:
        return torch.exp(-(separations.distances / length).square() / 2) * fading, None


SAMPLES = 256  # number of nearest samples from which a prediction is made, in whole arrays


class MovingArrayField(KrigedField):
    """Interpolates the field of a fixed transmitter from its samples y_m(r) = y(r + d_m) at all elements and places."""

    def __init__(self, region: Region, beamformer: Beamformer, wavelength: float):
        super().__init__(region, beamformer, wavelength, "responses")
        self._grid = beamformer.grid
        self._elements: Float[np.ndarray, "elements 3"] = float(self.wavelength) * beamformer.array.positions
        self.neighbours = max(2, SAMPLES // len(self._elements))
        self.register_buffer("offsets", torch.zeros(len(self._elements), 3))

    def keep(self, dataset: Dataset, known: Int[np.ndarray, " n"]) -> None:
        super().keep(dataset, known)
        self.offsets = torch.from_numpy(Rotation.from_quat(dataset.gateway_orientation).apply(self._elements)).float()

    def _maximise_likelihood(self) -> None:
        of = self._of_samples()
        fit_covariance(of, of.neighbours, partial(self.report, "covariance of responses"))
        self.shares, self.length, self.drift, self.nugget = of.shares, of.length, of.drift, of.nugget

    def _of_samples(self) -> KrigedField:
        """The same field, sampled by a single element that stands at all places of the elements in turn."""
        single = Beamformer(PlanarArray(1, 1), self._grid)
        found = KrigedField(self.region.numpy(), single, float(self.wavelength), "responses")
        found.places = (self.places[:, None] + self.offsets).flatten(0, 1)
        found.times = self.times.repeat_interleave(len(self.offsets))
        found.values, found.mean = self.values.reshape(-1, 2), torch.zeros(2)
        return found

    def _compiled_for(self, positions: Float[Tensor, "B 3"]) -> None:
        """None: the compiled loop krigs each element by itself."""

    def beamformed(self) -> None:
        """None: the large covariances of many positions at once would not fit into memory."""


WAYS = {
    "responses": "kriging of responses",
    "phases": "kriging of responses found from pictures",
    "spectra": "kriging of spectra",
    "smooth-spectra": "smooth kriging of spectra",
    "inverse-distance": "inverse-distance weighting",
    "field": "kriging of one field at the elements of all arrays",
}
"""Names of the ways of interpolation, for the user."""

OF_RESPONSES = "field", "responses", "phases"  # ways by which responses are interpolated


Built = tuple[Region, Beamformer, float]
"""What every model is built with: region, array and grid, wavelength."""


def kriging_ways(dataset: Dataset, known: Int[np.ndarray, " n"]) -> list[str]:
    """The ways of kriging that are worth a try, in this order."""
    if "response" in dataset.values:
        one_field = ["field"] if dataset.moving == "receiver" and dataset.array.elements > 1 else []
        return [*one_field, "responses", "spectra", "smooth-spectra"]
    return ["spectra", *(["phases"] if can_retrieve(dataset, known) else []), "smooth-spectra"]


def empty_field(way: str, built: Built) -> KrigedField:
    """A field of one way, without known spectra."""
    if way == "smooth-spectra":
        return SquaredExponentialField(*built)
    if way == "field":
        return MovingArrayField(*built)
    return KrigedField(*built, "responses" if way in OF_RESPONSES else "spectra")


class FieldFits:
    """Fits fields to known spectra of one dataset. Responses behind each picture are found only once."""

    def __init__(self, built: Built, dataset: Dataset):
        self.dataset, self._built = dataset, built
        self._retrieved = np.full((len(dataset.positions), dataset.array.elements), np.nan, complex)

    def fitted(
        self, way: str, known: Int[np.ndarray, " n"], report: Report, of_spectra: KrigedField | None = None
    ) -> KrigedField:
        field = empty_field(way, self._built)
        field.report = report  # type: ignore[method-assign]
        if way != "phases":
            field.fit(self.dataset, known)
            return field
        seen = with_contrast(self.dataset, known)
        if of_spectra is None or len(seen) < len(known):
            of_spectra = self.fitted("spectra", seen, report)
        missing = seen[np.isnan(self._retrieved[seen]).any(axis=1)]
        if len(missing):
            report("responses behind pictures", 0, 1)
            self._retrieved[missing] = retrieved_responses(self.dataset, missing)
        fit_to_pictures(field, of_spectra, self._retrieved[seen], self.dataset, seen)
        return field
