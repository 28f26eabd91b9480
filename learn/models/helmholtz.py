"""The default model: a weighted mean of Helmholtz kriging and inverse-distance weighting."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from jaxtyping import Complex, Float, Int
from torch import Tensor, nn

from learn.baselines.neighbours import NEIGHBOURS
from learn.data.metrics import ssim_of_each
from learn.models.band_field import BandField
from learn.models.base import Beamformed, Report, SpectrumModel
from learn.models.geometry import distances
from learn.models.kriged_field import KrigedField
from learn.models.quadrature import Quadrature
from learn.models.retrieved_field import can_retrieve, fit_to_pictures, retrieved_responses, with_contrast
from learn.models.smooth_field import SmoothField
from learn.models.stacking import LEAST_DISTANCE, best_weights, by_distance, left_out_by_distance, left_out_by_kriging
from simulate.dataset.dataset import Dataset
from simulate.spectra.angular_grid import COLUMNS, ROWS
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.spectrum import evenly, spectrum_of

WAYS = {
    "responses": "kriging of responses",
    "phases": "kriging of responses found from pictures",
    "spectra": "kriging of spectra",
    "smooth-spectra": "smooth kriging of spectra",
    "inverse-distance": "inverse-distance weighting",
    "field": "kriging of one field at the elements of all arrays",
}
"""Names of the ways of interpolation, for the user."""

OF_BAND = "band.field."
"""Where the names of the buffers of the field over the band begin, in a file of weights."""

LEFT_OUT = 64
"""Largest number of known spectra, evenly spread, that each way of interpolation predicts from the others."""

FOLDS, FOLDED = 8, 300
"""If few spectra are known, a covariance fitted to all of them predicts them too well. A way that is even then worse
than inverse-distance weighting is dropped. For each other way, the known spectra are divided into parts, and the
covariance is fitted once without each part, which it then predicts. There are FOLDED // n parts for n known samples (of
the field that all elements sample: elements times known spectra), at most FOLDS; if these are fewer than 2, the
covariance is not fitted again."""

PIECE = 16
"""Number of spectra that are interpolated at a time and added to those of responses. Kriging takes some MB for each."""

OF_RESPONSES = "field", "responses", "phases"
"""Ways by which responses are interpolated."""

CLEAR_LEAD = 0.04
"""If the mean SSIM of one of ``OF_RESPONSES`` exceeds that of inverse-distance weighting by more, no further way is
tried."""


class HelmholtzField(SpectrumModel):
    """A weighted mean of spectra interpolated in up to five ways.

    ``S(r) = w₁ S_responses(r) + w₂ S_spectra(r) + w₃ S_smooth(r) + w₄ S_distance(r)``

    ``KrigedField`` interpolates S_responses and S_spectra, and ``SmoothField`` interpolates S_smooth. S_distance is the
    mean of the nearest known spectra, weighted by 1 / distance. If responses are not known, they are found from the
    pictures where this improves the prediction (``fit_to_pictures``). If the receiver moves, the fifth way krigs the
    one field that the elements of the array sample at all its known places.

    Where known positions are dense, kriging of responses is best by far. Where they are many wavelengths apart, each
    says little about its neighbours, and the mean of several ways has the smallest error. ``fit`` finds the weights
    with which known spectra are best predicted from the others (stacking [wolpert1992]).

    Args:
        region: as for ``SpectrumModel``; this model does not use it.
        beamformer: the dataset's array and grid.
        wavelength: metres.

    Attributes:
        weights: w of each of ``WAYS``; they add up to 1.
        fields: the kriged fields that have a weight, by way. There is at least one, which keeps the known spectra.
        band: the field of responses over the band, under the name "field"; empty if the dataset has no band.
    """

    weights: Tensor

    def __init__(self, region: Float[np.ndarray, "2 3"], beamformer: Beamformer, wavelength: float):
        super().__init__(region, wavelength)
        self._beamformer = beamformer
        self.register_buffer("weights", torch.zeros(len(WAYS)))
        self.fields = nn.ModuleDict()
        self.band = nn.ModuleDict()
        self._found: tuple[Dataset, Complex[np.ndarray, "K elements"]] | None = None
        self._used: dict[str, float] = {}  # the weights as numbers, since an exported program cannot branch on a tensor

    def predict(
        self, positions: Float[Tensor, "B 3"]
    ) -> tuple[Float[Tensor, "B 90 360"], Float[Tensor, "B elements 2"] | None]:
        """Predict spectra, and the interpolated responses if the model interpolates any.

        The spectra are those of the responses only if no other way has a weight.

        Args:
            positions: transmitter positions, metres, world frame.
        """
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
        field: Any = self.fields["responses"]
        known = field.all_known_spectra()
        for way, weight in self._used.items():
            if way == "inverse-distance" and known is not None:
                from learn.models.quick_nearest import add_mean_of_nearest  # compiles, which training does not need

                of_known = field.places.numpy(), known.numpy(), weight, min(NEIGHBOURS, len(known)), LEAST_DISTANCE
                add_mean_of_nearest(spectra, positions.numpy(), *of_known)
            elif way != "responses":
                for some in torch.arange(len(positions)).split(PIECE):
                    spectra[some] += weight * self._by(way, positions[some]).numpy()

    def forward(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B 90 360"]:
        """Predicted spectrum: the weighted mean."""
        return _sum({way: self._by(way, positions) for way in self._used}, self._used)

    def coarse(self, positions: Float[Tensor, "B 3"], pixels: Quadrature) -> Float[Tensor, "B H W"]:
        """As for ``SpectrumModel``."""
        return _sum({way: self._by(way, positions, pixels) for way in self._used}, self._used)

    def uncertainty(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, " B"] | None:
        """Kriging variance, that of responses if these are interpolated. None for inverse-distance weighting alone."""
        kriged = [way for way in self._used if way in self.fields]
        if not kriged:
            return None
        field: Any = self.fields[kriged[0]]
        return field.uncertainty(positions)

    def band_responses(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B elements subcarriers 2"] | None:
        """Responses over the band, in the units of the known ones. None: the dataset has no band.

        Args:
            positions: transmitter positions, metres, world frame.
        """
        if "field" not in self.band:
            return None
        field: Any = self.band["field"]
        return field.band_responses(positions)

    def fit(self, dataset: Dataset, known: Int[np.ndarray, " n"]) -> str:
        """Keep the known spectra, and find the weights with which they are best predicted from one another.

        Args:
            dataset: a dataset; its responses are interpolated only if it has any.
            known: indices of the spectra to interpolate.

        Returns:
            The weights, and the scores by which they were chosen, as a sentence for the user.
        """
        known = np.unique(known)
        of_band = self._fit_band(dataset, known)
        if len(known) == 1:
            self._set({"inverse-distance": 1.0}, {"spectra": self._fitted("spectra", dataset, known, self.report)})
            return "predicts the only known spectrum everywhere"
        left_out = evenly(np.arange(len(known)), LEFT_OUT)
        truth = spectrum_of(dataset.pictures[known[left_out]])
        fields: dict[str, KrigedField] = {}
        predicted: dict[str, Float[np.ndarray, "L 90 360"]] = {}
        scores: dict[str, float] = {}
        for way in _ways(dataset, known):
            best = max((scores[each] for each in OF_RESPONSES if each in scores), default=0.0)
            if best > scores.get("inverse-distance", 1) + CLEAR_LEAD:
                break
            field = fields[way] = self._fitted(way, dataset, known, self.report, fields.get("spectra"))
            if not predicted:
                predicted["inverse-distance"] = left_out_by_distance(field, left_out)
                scores["inverse-distance"] = float(ssim_of_each(predicted["inverse-distance"], truth).mean())
            samples = len(known) * (dataset.array.elements if way == "field" else 1)
            folds = min(FOLDS, FOLDED // samples)
            if way == "phases":  # the other spectra's phases were found using the left-out ones
                predicted[way] = self._left_out_with_others_phases(dataset, known, left_out, max(1, folds))
                scores[way] = float(ssim_of_each(predicted[way], truth).mean())
                continue
            spectra = left_out_by_kriging(field, left_out)
            scores[way] = float(ssim_of_each(spectra, truth).mean())
            if folds > 1:
                if scores[way] < scores["inverse-distance"]:
                    continue
                spectra = self._left_out_of_folds(way, dataset, known, left_out, folds)
                scores[way] = float(ssim_of_each(spectra, truth).mean())
            predicted[way] = spectra
        self.report("weights", 0, 1)
        weights, score = best_weights({way: predicted[way] for way in WAYS if way in predicted}, truth)
        self._set(weights, fields)
        parts = [f"{weight:.0%} {WAYS[way]}" for way, weight in sorted(weights.items(), key=lambda item: -item[1])]
        found = ", ".join(f"{way} {value:.3f}" for way, value in scores.items())
        together = f"; together {score:.3f}" if len(parts) > 1 else ""
        return (
            f"interpolates by {' and '.join(parts)} (mean SSIM of known spectra predicted from the others: {found}"
            f"{together}){of_band}"
        )

    def refit(self, dataset: Dataset, known: Int[np.ndarray, " n"]) -> None:
        """Keep other known spectra with the same weights. The covariances are fitted again.

        Args:
            dataset: as for ``fit``.
            known: indices of the spectra to interpolate.
        """
        known = np.unique(known)
        self._set(self._used, {way: self._fitted(way, dataset, known, self.report) for way in self.fields})
        self._fit_band(dataset, known)

    def _fit_band(self, dataset: Dataset, known: Int[np.ndarray, " n"]) -> str:
        """Fit the field over the band, if the dataset has one. Return what was found, to be added to a sentence."""
        if dataset.band_responses is None:
            return ""
        field = self._empty_band()
        field.report = self.report  # type: ignore[method-assign]
        found = field.fit(dataset, known)
        self.band = nn.ModuleDict({"field": field})
        return f"; responses over the band: {found}"

    def _empty_band(self) -> BandField:
        return BandField(self.region.cpu().numpy().copy(), self._beamformer, float(self.wavelength))

    def _fitted(
        self,
        way: str,
        dataset: Dataset,
        known: Int[np.ndarray, " n"],
        report: Report,
        of_spectra: KrigedField | None = None,
    ) -> KrigedField:
        """A field of one way, fitted to known spectra. ``of_spectra`` is that of spectra if there is one already."""
        field = self._empty(way)
        field.report = report  # type: ignore[method-assign]
        if way == "phases":
            seen = with_contrast(dataset, known)
            if of_spectra is None or len(seen) < len(known):
                of_spectra = self._fitted("spectra", dataset, seen, report)
            fit_to_pictures(field, of_spectra, self._retrieved(dataset, seen), dataset, seen)
        else:
            field.fit(dataset, known)
        return field

    def _retrieved(self, dataset: Dataset, known: Int[np.ndarray, " n"]) -> Complex[np.ndarray, "n elements"]:
        """As ``retrieved_responses``, but those of each picture are found only once."""
        if self._found is None or self._found[0] is not dataset:
            self._found = dataset, np.full((len(dataset.positions), dataset.array.elements), np.nan, complex)
        found = self._found[1]
        missing = known[np.isnan(found[known]).any(axis=1)]
        if len(missing):
            self.report("responses behind pictures", 0, 1)
            found[missing] = retrieved_responses(dataset, missing)
        return found[known]

    def _left_out_with_others_phases(
        self, dataset: Dataset, known: Int[np.ndarray, " n"], left_out: Int[np.ndarray, " L"], folds: int
    ) -> Float[np.ndarray, "L 90 360"]:
        """Some known spectra, each predicted from others whose phases were found without it.

        With several folds, every part of the known spectra is predicted from the other parts. With one fold, the
        left-out spectra are predicted from all others.
        """
        predicted = np.zeros((len(left_out), ROWS, COLUMNS), np.float32)
        for fold in range(folds):
            self.report("score by phases", fold, folds)
            part = np.flatnonzero(left_out % folds == fold)
            others = np.ones(len(known), bool)
            others[left_out[part] if folds == 1 else np.arange(fold, len(known), folds)] = False
            field = self._fitted("phases", dataset, known[others], SpectrumModel.report)
            for some in np.array_split(part, max(1, len(part) // 16)):
                places = torch.from_numpy(dataset.positions[known[left_out[some]]]).float()
                with torch.inference_mode():
                    predicted[some] = field(places).numpy()
        return predicted

    def _left_out_of_folds(
        self, way: str, dataset: Dataset, known: Int[np.ndarray, " n"], left_out: Int[np.ndarray, " L"], folds: int
    ) -> Float[np.ndarray, "L 90 360"]:
        """As ``left_out_by_kriging``, with covariances that are fitted without the part that they predict."""
        predicted = np.zeros((len(left_out), ROWS, COLUMNS), np.float32)
        for fold in range(folds):
            self.report(f"score by {way}", fold, folds)
            field = self._fitted(way, dataset, known[np.arange(len(known)) % folds != fold], SpectrumModel.report)
            field.keep(dataset, known)
            part = left_out % folds == fold
            predicted[part] = left_out_by_kriging(field, left_out[part])
        return predicted

    def _empty(self, way: str) -> KrigedField:
        """A field of one way, without known spectra."""
        built = self.region.cpu().numpy().copy(), self._beamformer, float(self.wavelength)
        if way == "smooth-spectra":
            return SmoothField(*built)
        if way == "field":
            return KrigedField(*built, "field")
        return KrigedField(*built, "responses" if way in OF_RESPONSES else "spectra")

    def _set(self, weights: dict[str, float], fields: Mapping[str, KrigedField]) -> None:
        """Use these weights, and keep only the fields that are needed."""
        self.weights = torch.tensor([weights.get(way, 0.0) for way in WAYS])
        self._used = {way: weights[way] for way in WAYS if way in weights}
        needed = [way for way in fields if way in weights] or list(fields)[:1]
        self.fields = nn.ModuleDict({way: fields[way] for way in needed})

    def _by(
        self, way: str, positions: Float[Tensor, "B 3"], pixels: Quadrature | None = None
    ) -> Float[Tensor, "B H W"]:
        """Spectra predicted by one way, whole or at a few pixels."""
        if way in self.fields:
            model: Any = self.fields[way]
            return model(positions) if pixels is None else model.coarse(positions, pixels)
        field: Any = next(iter(self.fields.values()))
        spectra = by_distance(field, distances(positions, field.places))
        return spectra if pixels is None else spectra[:, pixels.rows][:, :, pixels.columns]

    def load_state_dict(self, state_dict: Mapping[str, Any], strict: bool = True, assign: bool = False) -> Any:
        """As ``torch.nn.Module.load_state_dict``, but first makes the fields that the file has.

        Raises:
            RuntimeError: also if a way that has a weight has no field, or if the weights are not shares of 1.
        """
        fields: dict[str, KrigedField] = {}
        for way in WAYS:
            prefix = f"fields.{way}."
            of_field = {name.removeprefix(prefix): each for name, each in state_dict.items() if name.startswith(prefix)}
            if of_field:
                fields[way] = self._empty(way)
                fields[way].load_state_dict(of_field)
        self.fields = nn.ModuleDict(fields)
        of_band = {name.removeprefix(OF_BAND): each for name, each in state_dict.items() if name.startswith(OF_BAND)}
        self.band = nn.ModuleDict({"field": self._empty_band()} if of_band else {})
        if of_band:
            self.band["field"].load_state_dict(of_band)
        weights = state_dict.get("weights", self.weights)
        if 0 < len(weights) < len(WAYS):  # an older version knew fewer ways
            state_dict = {**state_dict, "weights": torch.cat([weights, weights.new_zeros(len(WAYS) - len(weights))])}
        loaded = super().load_state_dict(state_dict, strict, assign)
        self._used = {way: weight for way, weight in zip(WAYS, self.weights.tolist(), strict=True) if weight}
        missing = self._used.keys() - fields.keys() - {"inverse-distance"}
        if missing or not fields:
            raise RuntimeError(f"no field of {min(missing, default='any way')}")
        if not (min(self._used.values(), default=0) > 0 and abs(sum(self._used.values()) - 1) < 1e-3):
            raise RuntimeError(f"weights that are not shares of 1, {self.weights.tolist()}")
        return loaded


def _sum(spectra: Mapping[str, Float[Tensor, "B H W"]], weights: Mapping[str, float]) -> Float[Tensor, "B H W"]:
    """The weighted sum of spectra predicted by several ways."""
    (first, weight), *others = weights.items()
    if weight == 1:  # spares a copy
        return spectra[first]
    total = weight * spectra[first]
    for way, each in others:
        total.add_(spectra[way], alpha=each)
    return total


def _ways(dataset: Dataset, known: Int[np.ndarray, " n"]) -> list[str]:
    """The ways of kriging that are tried, in this order."""
    if dataset.responses is not None:
        one_field = ["field"] if dataset.moving == "receiver" and dataset.array.elements > 1 else []
        return [*one_field, "responses", "spectra", "smooth-spectra"]
    return ["spectra", *(["phases"] if can_retrieve(dataset, known) else []), "smooth-spectra"]
