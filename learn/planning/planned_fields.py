"""The random fields for which positions are planned, with covariances fitted to a run's spectra or to traced ones."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import torch
from jaxtyping import Float, Inexact
from scipy.linalg import cho_factor, cho_solve

from learn.fitted.fitted_method import fit_method
from learn.models.base import Report
from learn.models.kriging.helmholtz import HelmholtzField
from learn.models.kriging.interpolators import WAYS
from learn.models.kriging.kriged_field import KrigedField
from learn.planning.greedy import OpenField
from learn.powers.helmholtz_powers import HelmholtzPowers
from learn.training.run_folder import SpectrumRun
from scenes.scene.description import Scene
from simulate.dataset.dataset import Dataset
from simulate.rays.core.propagation import Propagation
from simulate.spectra.spectrum import evenly

TRACED = 300  # Number of positions at which a scene is traced, to fit the covariance of its field

LEAST_NUGGET = 0.01
"""Least variance of a measurement's noise in a plan, relative to the field's variance. Fits to traced responses find
less. A plan with so little noise would repeat measurements next to earlier ones, to gain the last per cent there."""

LEAST_FIELD = 1e-6  # Least share of a power's variance that its field has; the rest is noise

KNOWN_MOST = 2000  # Largest number of known positions that are used, evenly spread over all of them

ROWS = 500  # Number of rows of a covariance that are computed at a time, which bounds the memory


@dataclass(frozen=True)
class Field:
    """A random field of variance 1 over the transmitter's position."""

    # function from positions a and b, metres, to the covariance between them, real or complex
    covariance: Callable[[Float[np.ndarray, "n 3"], Float[np.ndarray, "m 3"]], Inexact[np.ndarray, "n m"]]
    nugget: float  # variance of a measurement's noise, above 0
    weight: float = 1.0  # weight of this field's kriging variance among several fields

    def open_at(self, candidates: Float[np.ndarray, "N 3"], known: Float[np.ndarray, "n 3"]) -> OpenField:
        """What is still unknown of the weighted field at candidates when known positions are measured."""
        covariance = self.covariance(candidates, candidates)
        if len(known):
            known = evenly(known, KNOWN_MOST)
            across = self.covariance(known, candidates)
            factor = cho_factor(self.covariance(known, known) + self.nugget * np.eye(len(known)))
            covariance -= across.conj().T @ cho_solve(factor, across)
        return OpenField(self.weight * covariance, self.weight * self.nugget)


def fields_of_scene(scene: Scene, propagation: Propagation, seed: int, report: Report) -> list[Field]:
    """The field of the responses of each gateway, with a covariance fitted to responses at ``TRACED`` positions."""
    from simulate.generation.simulation import simulate  # needs the ray tracer, which measured data do not

    fields = []
    for place in scene.by_gateway().values():
        with TemporaryDirectory() as folder:
            traced = simulate(place, Path(folder) / "traced", TRACED, seed=seed, propagation=propagation)
        field = KrigedField(np.zeros((2, 3)), traced.beamformer, traced.wavelength, "responses")
        field.report = report  # type: ignore[method-assign]
        field.fit(traced, np.arange(TRACED))
        fields.append(_planned_with(field))
    return fields


def fields_of_run(run: SpectrumRun, dataset: Dataset, report: Report) -> list[Field]:
    """The fields that a run of ``helmholtz`` interpolates; for another model, those that ``helmholtz`` would."""
    model = run.model
    if not isinstance(model, HelmholtzField):
        model = HelmholtzField(np.zeros((2, 3)), dataset.beamformer, dataset.wavelength)
        model.report = report  # type: ignore[method-assign]
        model.fit(dataset, run.split(dataset).known)
    return fields_of_model(model)


def fields_of_powers(dataset: Dataset, seed: int) -> list[Field]:
    """The field of received powers in dB about the law of distance, with the covariance that ``helmholtz`` fits.

    Its covariance is the same for all gateways up to a factor, so that one field stands for all. The law is taken for
    known.
    """
    method = fit_method(dataset, "power", seed=seed).method
    assert isinstance(method, HelmholtzPowers)
    covariance, noise = method.covariance, method.covariance.shares[2]
    field = max(1 - float(noise), LEAST_FIELD)
    return [Field(lambda a, b: covariance(a, b) / field, max(LEAST_NUGGET, float(noise) / field))]


def fields_of_model(model: HelmholtzField) -> list[Field]:
    """The fields that a fitted model interpolates, with their weights."""
    weights = dict(zip(WAYS, model.weights.tolist(), strict=True))
    kriged = {way: field for way, field in model.fields.items() if weights[way]}
    fields = []
    for way, field in (kriged or dict(model.fields.items())).items():  # inverse-distance may have all the weight
        assert isinstance(field, KrigedField)
        fields.append(_planned_with(field, weights[way] or 1.0))
    return fields


def _planned_with(field: KrigedField, weight: float = 1.0) -> Field:
    """A kriged field without its known spectra. A field of responses has a complex covariance."""
    shares, length = field.shares.double(), field.length.double()

    def covariance(a: Float[np.ndarray, "n 3"], b: Float[np.ndarray, "m 3"]) -> Inexact[np.ndarray, "n m"]:
        rows_of_a, all_b = torch.from_numpy(a - b[0]).to(shares.device), torch.from_numpy(b - b[0]).to(shares.device)
        parts = []
        for rows in rows_of_a.split(ROWS):
            static = torch.ones(len(rows), len(b), dtype=torch.float64, device=shares.device)
            with torch.inference_mode():
                part = field.covariance(rows, all_b, static, shares, length).cpu().numpy()
            if field.of_responses:  # the left half of its matrix is the real part above the imaginary part
                part = part[: len(rows), : len(b)] + 1j * part[len(rows) :, : len(b)]
            parts.append(part)
        return np.concatenate(parts)

    return Field(covariance, max(LEAST_NUGGET, float(field.nugget)), weight)
