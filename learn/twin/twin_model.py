"""The twin: ray tracing of a scene that was corrected by the known spectra, and Helmholtz kriging of the remainder.

The scene's unknowns are corrected first, then a complex gain of each chain of interactions is found. The
prediction is a weighted mean of both together and of kriging alone (stacking [wolpert1992]), as very many
known spectra predict the field better than any description of the place.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from jaxtyping import Complex, Float, Int, UInt8
from torch import Tensor

from learn.data.metrics import ssim_of_each
from learn.models.capabilities import PredictsResponses
from learn.models.kriging.kriged_field import KrigedField
from scenes.files.errors import InputError, ParameterError
from scenes.scene.description import Scene
from scenes.scene.shapes import bounding_box
from scenes.scene.tolerances import Tolerances
from scenes.scene.unknowns import unknowns, vary
from scenes.storage.scene_yaml import load_scene
from simulate.dataset.dataset import Dataset
from simulate.rays.core.propagation import Propagation
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.spectrum import evenly, spectrum_of

if TYPE_CHECKING:
    from learn.twin.calibration import Calibration
    from simulate.rays.tracer import Tracer

TRUSTS = (1.0, 0.75, 0.5, 0.25, 0.0)  # Candidates for the weight of the corrected scene

LEAST_KNOWN, LEFT_OUT = 100, 64
"""Number of known spectra below which the weight is 1, and largest number of them that are predicted from others."""

GAINED_BY = 1000  # Largest number of known spectra from which the gains of chains are found

SAME_RESPONSES = 1e-2
"""Largest relative error of the responses at a known position with which a scene counts as that of the training."""


class Twin(PredictsResponses):
    """Traces responses in a corrected scene, and adds kriging of what the tracing does not explain.

    The responses are ``y(r) = w (f(r; θ, g) + e(r)) + (1 − w) a(r)``, with the traced responses f.

    ``fit`` first finds θ, the corrections of the scene's description (``learn.twin.gauss_newton``), and then the
    complex gains g of the chains of interactions (``learn.twin.gains``), with ``f = Σ_c (1 + g_c) f_c``.
    ``KrigedField`` interpolates e from the difference between the known responses and f, and a from the known responses
    themselves. If these are found behind pictures, f determines their phases. A few spectra are enough for θ and g; e
    and a dominate where many are known.
    """

    # the mechanisms that rays follow. A run does not keep it, and traces with the defaults.
    propagation: Propagation = Propagation()

    values: Tensor  # θ, in the order of ``scenes.scene.unknowns.unknowns``
    gains: Tensor  # g (real, imaginary); none before ``fit``
    # f (real, imaginary) at the first known position. With it, a loaded run recognises a changed scene.
    checked: Tensor
    trust: Tensor  # w
    power: Tensor  # mean of ``|e|²`` over the known spectra and elements
    whole_power: Tensor  # the same mean of the known responses

    def __init__(
        self,
        region: Float[np.ndarray, "2 3"],
        beamformer: Beamformer,
        wavelength: float,
        scene: str = "",
        position: float = Tolerances.position,
        rotation: float = Tolerances.rotation,
        objects: float = Tolerances.objects,
        materials: float = Tolerances.materials,
    ):
        super().__init__(region, beamformer, wavelength)
        if not scene:
            raise ParameterError("scene", "expected the scene that the model twin traces, found none")
        self._described = load_scene(scene)
        self._unexplained = 1.0
        self.calibration: Calibration | None = None
        self._tolerances = Tolerances(position, rotation, objects, materials)
        self._which = unknowns(self._described, self._tolerances)
        self.register_buffer("values", torch.zeros(len(self._which), dtype=torch.float64))
        self.register_buffer("gains", torch.zeros(0, 2))
        self.register_buffer("checked", torch.zeros(beamformer.array.elements, 2))
        self.register_buffer("trust", torch.ones(()))
        self.register_buffer("power", torch.zeros(()))
        self.register_buffer("whole_power", torch.zeros(()))
        self.rest = KrigedField(region, beamformer, wavelength, "responses")
        self.whole = KrigedField(region, beamformer, wavelength, "responses")

    @property
    def corrected(self) -> Scene:
        """The scene as corrected; before ``fit`` as described."""
        return vary(self._described, self._which, self.values.cpu().numpy())

    def responses(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B elements 2"]:
        """Element responses y (real, imaginary): traced; after ``fit``, also mixed with what is interpolated."""
        trust = float(self.trust)
        if not trust:
            return self.whole_power.sqrt() * self.whole.responses(positions)
        traced = _pairs(self._traced(positions.cpu().numpy())).to(positions.device)
        if not len(self.rest.places):
            return traced
        rest = self.rest.responses(positions)
        return self._mixed(traced, rest, self.whole.responses(positions) if trust < 1 else rest, trust)

    def _mixed(
        self,
        traced: Float[Tensor, "B elements 2"],
        rest: Float[Tensor, "B elements 2"],
        whole: Float[Tensor, "B elements 2"],
        trust: float,
    ) -> Float[Tensor, "B elements 2"]:
        """w (f + e) + (1 − w) a."""
        return trust * (traced + self.power.sqrt() * rest) + (1 - trust) * self.whole_power.sqrt() * whole

    def uncertainty(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, " B"]:
        """Variance of w e + (1 − w) a relative to the power of the responses; e and a are assumed to be independent."""
        trust, total = float(self.trust), torch.zeros(len(positions), device=positions.device)
        for weight, field, power in ((trust, self.rest, self.power), (1 - trust, self.whole, self.whole_power)):
            if weight:
                total = total + weight**2 * power / self.whole_power.clamp(min=1e-30) * field.uncertainty(positions)
        return total.clamp(0, 1)

    def fit(self, dataset: Dataset, known: Int[np.ndarray, " n"]) -> str:
        """Correct the scene by known spectra, and krige what it does not explain of them."""
        from learn.twin.calibrate import CALIBRATED_BY, correct

        def report(sentence: str) -> None:
            self.report(f"calibration: {sentence}", 0, 1)

        used = evenly(np.unique(known), CALIBRATED_BY)
        found = correct(self._described, dataset, used, self._tolerances, self.propagation, report)
        self.calibration = found
        self.values, self.gains = torch.from_numpy(found.values), torch.zeros(0, 2)
        self.__dict__.pop("_tracer", None)
        self.refit(dataset, known)
        chains = int(self.gains.any(dim=1).sum())
        return (
            f"corrected {len(self._which)} numbers of the scene: the unexplained power of {len(used)} spectra fell "
            f"from {found.misfit[1]:.1%} to {found.misfit[0]:.1%}; with gains of {chains} chains, "
            f"{self._unexplained:.1%} of the power of held-out spectra is unexplained; the scene has a weight of "
            f"{float(self.trust):g}"
        )

    def refit(self, dataset: Dataset, known: Int[np.ndarray, " n"]) -> None:
        """Krige what the corrected scene does not explain of other known spectra."""
        from learn.twin.calibrate import measured_responses
        from learn.twin.gains import aligned_to, unexplained

        known = np.unique(known)
        measured, phases_known = measured_responses(dataset, known)
        if not phases_known:  # a picture of one grey level contains nothing about the field
            seen = measured.any(axis=1)
            if not seen.any():
                raise InputError(f"{dataset.folder}: expected spectra of several grey levels, found none")
            known, measured = known[seen], measured[seen]
        flips = self._described.gateway.elements is None  # elements at given places have no such symmetry
        held_out = self._fit_gains(dataset.positions[known], measured, phases_known, flips)
        traced = self._traced(dataset.positions[known])
        self.checked = _pairs(traced)[0]
        aligned = aligned_to(measured, traced, phases_known, flips)[0]
        aligned_held_out = aligned_to(measured, held_out, phases_known, flips)[0]
        self._unexplained = unexplained(aligned_held_out - held_out, aligned_held_out)
        self.power, self.whole_power = (
            torch.tensor(float((np.abs(values) ** 2).mean())) for values in (aligned - traced, aligned)
        )
        has_weight = len(known) >= LEAST_KNOWN  # fewer cannot tell the weight, and the scene has all of it
        for field, values in ((self.rest, aligned - traced), (self.whole, aligned)):
            everywhere = np.zeros((len(dataset.positions), values.shape[1]), np.complex64)
            everywhere[known] = values
            field.report = self.report  # type: ignore[method-assign]
            (field.fit if has_weight or field is self.rest else field.keep)(
                dataset.with_values(response=everywhere), known
            )
        self.trust = torch.tensor(self._best_trust(_pairs(held_out), dataset.pictures[known]) if has_weight else 1.0)

    def _best_trust(self, traced: Float[Tensor, "n elements 2"], pictures: UInt8[np.ndarray, "n 90 360"]) -> float:
        """The w that best predicts known spectra from the others; the largest one if several are equally good."""
        left_out = torch.from_numpy(evenly(np.arange(len(traced)), LEFT_OUT))
        spectra = spectrum_of(pictures[left_out.numpy()])

        def score(trust: float) -> float:
            found = self.beamforming(self._mixed(traced[left_out], rest, whole, trust)).numpy()
            return float(ssim_of_each(found, spectra).mean())

        with torch.inference_mode():
            rest, whole = (
                field.interpolated(field.places[left_out], left_out)[0].unflatten(-1, (-1, 2))
                for field in (self.rest, self.whole)
            )
            return max(TRUSTS, key=score)

    def _fit_gains(
        self,
        positions: Float[np.ndarray, "n 3"],
        measured: Complex[np.ndarray, "n elements"],
        phases_known: bool,
        flips: bool,
    ) -> Complex[np.ndarray, "n elements"]:
        """Find g from responses. The arguments are those of ``learn.twin.gains.aligned_gains``."""
        from learn.twin.gains import aligned_gains

        self.gains = torch.zeros(0, 2)
        used = evenly(np.arange(len(positions)), GAINED_BY)
        by_chain, traced = self._tracer.responses_by_chain(positions[used]), self._traced(positions[used])
        gains, held_out_used = aligned_gains(by_chain, traced, measured[used], phases_known, flips, self.report)
        self.gains = _pairs(gains)
        held_out = self._traced(positions)
        held_out[used] = held_out_used
        return held_out

    @cached_property
    def _tracer(self) -> Tracer:
        """The tracer of the corrected scene."""
        from simulate.rays.tracer import Tracer

        everywhere = bounding_box(np.concatenate([self.region.cpu().numpy(), self._described.transmitter.region]))
        tracer = Tracer(self.corrected, self.propagation, everywhere)
        if len(self.gains):
            place, expected = self.rest.places[:1].double().cpu().numpy(), self.checked.cpu()
            same = tracer.chains == len(self.gains)
            if same:
                off = _pairs(tracer.responses(place, self._factors)) - expected
                same = float(off.norm()) <= SAME_RESPONSES * float(expected.norm())
            if not same:
                raise InputError(
                    f"{self._described.name}: expected the scene that the twin was trained with, found one with other "
                    "paths; train the twin again"
                )
        return tracer

    @property
    def _factors(self) -> Complex[np.ndarray, " chains"] | None:
        """1 + g; None before ``fit``."""
        return 1 + torch.view_as_complex(self.gains.cpu()).numpy() if len(self.gains) else None

    def _traced(self, positions: Float[np.ndarray, "B 3"]) -> Complex[np.ndarray, "B elements"]:
        return self._tracer.responses(np.asarray(positions, float), self._factors)

    def load_state_dict(self, state_dict: Mapping[str, Any], strict: bool = True, assign: bool = False) -> Any:
        """As ``torch.nn.Module.load_state_dict``, but for the number of chains that the file has."""
        self.__dict__.pop("_tracer", None)
        gains = state_dict.get("gains", self.gains)
        self.gains = torch.zeros(len(gains) if gains.ndim == 2 else 0, 2)
        return super().load_state_dict(state_dict, strict, assign)


def _pairs(responses: Complex[np.ndarray, "B elements"]) -> Float[Tensor, "B elements 2"]:
    """Complex numbers as (real, imaginary)."""
    return torch.view_as_real(torch.from_numpy(responses)).float()
