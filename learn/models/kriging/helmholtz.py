"""The default model: a weighted mean of Helmholtz kriging and inverse-distance weighting."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from jaxtyping import Float, Int
from torch import Tensor, nn

from learn.models.base import Beamformed, Region, SpectrumModel, part_of, runs_compiled
from learn.models.kriging.band_field import BandField
from learn.models.kriging.interpolators import WAYS, Built, FieldFits, empty_field
from learn.models.kriging.kriged_field import KrigedField
from learn.models.kriging.stacking import best_mixture, by_distance
from learn.models.kriging.wave_covariance import distances
from learn.models.quadrature import Quadrature
from simulate.dataset.dataset import Dataset
from simulate.spectra.beamformer import Beamformer

PIECE = 16
"""Number of spectra that are interpolated at a time and added to those of responses. Kriging takes some MB for each."""


class HelmholtzField(SpectrumModel):
    """A weighted mean of spectra interpolated in up to five of the ``WAYS``.

    ``fit`` finds the weights with which known spectra are best predicted from the others (stacking [wolpert1992]).
    """

    weights: Tensor  # w of each of ``WAYS``; they add up to 1

    def __init__(self, region: Region, beamformer: Beamformer, wavelength: float):
        super().__init__(region, wavelength)
        self._beamformer = beamformer
        self.register_buffer("weights", torch.zeros(len(WAYS)))
        self.fields = nn.ModuleDict()
        self.band = nn.ModuleDict()
        self._fitting: FieldFits | None = None
        self._used: dict[str, float] = {}  # the weights as numbers, since an exported program cannot branch on a tensor

    def predict(
        self, positions: Float[Tensor, "B 3"]
    ) -> tuple[Float[Tensor, "B 90 360"], Float[Tensor, "B elements 2"] | None]:
        """Predict spectra, and interpolated responses if any; the spectra are theirs if no other way has a weight."""
        of_responses = next((way for way in ("field", "responses") if way in self._used), None)
        if of_responses is None:
            return self(positions), None
        field: Any = self.fields[of_responses]
        responses = field.responses(positions)
        spectra = {
            way: field.beamforming(responses) if way == of_responses else self._by(way, positions) for way in self._used
        }
        return _sum(spectra, self._used), responses

    def beamformed(self) -> Beamformed | None:
        """As for ``SpectrumModel``: if each element's known responses are interpolated."""
        weight, field = self._used.get("responses"), self.fields["responses"] if "responses" in self.fields else None
        if weight is None or not isinstance(field, KrigedField) or "field" in self._used:
            return None
        return Beamformed(field.responses, field.beamforming, weight, self._add_others if len(self._used) > 1 else None)

    def _add_others(self, positions: Float[Tensor, "B 3"], spectra: Float[np.ndarray, "B 90 360"]) -> None:
        """Add the spectra that other ways than kriging of responses predict, by their weights."""
        for way, weight in self._used.items():
            for start in range(0, len(positions) if way != "responses" else 0, PIECE):
                piece = slice(start, start + PIECE)
                spectra[piece] += weight * self._by(way, positions[piece]).numpy()

    def forward(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B 90 360"]:
        return _sum({way: self._by(way, positions) for way in self._used}, self._used)

    def coarse(self, positions: Float[Tensor, "B 3"], pixels: Quadrature) -> Float[Tensor, "B H W"]:
        return _sum({way: self._by(way, positions, pixels) for way in self._used}, self._used)

    def uncertainty(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, " B"] | None:
        """Kriging variance, that of responses if these are interpolated. None for inverse-distance weighting alone."""
        kriged = [way for way in self._used if way in self.fields]
        if not kriged:
            return None
        field: Any = self.fields[kriged[0]]
        return field.uncertainty(positions)

    def band_responses(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B elements subcarriers 2"] | None:
        """Responses over the band, in the units of the known ones. None: the dataset has no band."""
        if "field" not in self.band:
            return None
        field: Any = self.band["field"]
        return field.band_responses(positions)

    def fit(self, dataset: Dataset, known: Int[np.ndarray, " n"]) -> str:
        """Keep the known spectra, and find the weights with which they are best predicted from one another."""
        known = np.unique(known)
        of_band = self._fit_band(dataset, known)
        if len(known) == 1:
            field = self._fits(dataset).fitted("spectra", known, self.report)
            self._set({"inverse-distance": 1.0}, {"spectra": field})
            return "predicts the only known spectrum everywhere"
        mixture = best_mixture(self._fits(dataset), known, self.report)
        self._set(mixture.weights, mixture.fields)
        return f"{mixture}{of_band}"

    def refit(self, dataset: Dataset, known: Int[np.ndarray, " n"]) -> None:
        """Keep other known spectra with the same weights. The covariances are fitted again."""
        known = np.unique(known)
        fits = self._fits(dataset)
        self._set(self._used, {way: fits.fitted(way, known, self.report) for way in self.fields})
        self._fit_band(dataset, known)

    def _fit_band(self, dataset: Dataset, known: Int[np.ndarray, " n"]) -> str:
        """Fit the field over the band, if the dataset has one, and say what was found."""
        if dataset.band is None:
            return ""
        field = BandField(*self._built)
        field.report = self.report  # type: ignore[method-assign]
        found = field.fit(dataset, known)
        self.band = nn.ModuleDict({"field": field})
        return f"; responses over the band: {found}"

    @property
    def _built(self) -> Built:
        return self.region.cpu().numpy(), self._beamformer, float(self.wavelength)

    def _fits(self, dataset: Dataset) -> FieldFits:
        if self._fitting is None or self._fitting.dataset is not dataset:
            self._fitting = FieldFits(self._built, dataset)
        return self._fitting

    def _set(self, weights: dict[str, float], fields: Mapping[str, KrigedField]) -> None:
        self.weights = torch.tensor([weights.get(way, 0.0) for way in WAYS])
        self._used = {way: weights[way] for way in WAYS if way in weights}
        # In the order in which a file is read, since inverse-distance weighting uses the first field.
        needed = [way for way in WAYS if way in fields and way in weights] or list(fields)[:1]
        self.fields = nn.ModuleDict({way: fields[way] for way in needed})

    def _by(
        self, way: str, positions: Float[Tensor, "B 3"], pixels: Quadrature | None = None
    ) -> Float[Tensor, "B H W"]:
        if way in self.fields:
            model: Any = self.fields[way]
            return model(positions) if pixels is None else model.coarse(positions, pixels)
        field: Any = next(iter(self.fields.values()))
        known = field.all_known_spectra() if runs_compiled(positions) else None
        spectra = by_distance(field, distances(positions, field.places), known)
        return spectra if pixels is None else spectra[:, pixels.rows][:, :, pixels.columns]

    def _load_from_state_dict(self, state_dict: Mapping[str, Tensor], prefix: str, *others: Any) -> None:
        """As for ``torch.nn.Module``, but first makes the fields that the file has."""
        numbers = part_of(state_dict, prefix)
        fields = {way: empty_field(way, self._built) for way in WAYS if part_of(numbers, f"fields.{way}.")}
        self.fields = nn.ModuleDict(fields)
        self.band = nn.ModuleDict({"field": BandField(*self._built)} if part_of(numbers, "band.field.") else {})
        super()._load_from_state_dict(state_dict, prefix, *others)
        self._used = {way: weight for way, weight in zip(WAYS, self.weights.tolist(), strict=True) if weight}
        missing = self._used.keys() - fields.keys() - {"inverse-distance"}
        if missing or not fields:
            raise RuntimeError(f"no field of {min(missing, default='any way')}")
        if not (min(self._used.values(), default=0) > 0 and abs(sum(self._used.values()) - 1) < 1e-3):
            raise RuntimeError(f"weights that are not shares of 1, {self.weights.tolist()}")


def _sum(spectra: Mapping[str, Float[Tensor, "B H W"]], weights: Mapping[str, float]) -> Float[Tensor, "B H W"]:
    """The weighted sum of spectra predicted by several ways."""
    (first, weight), *others = weights.items()
    if weight == 1:  # spares a copy
        return spectra[first]
    total = weight * spectra[first]
    for way, each in others:
        total.add_(spectra[way], alpha=each)
    return total
