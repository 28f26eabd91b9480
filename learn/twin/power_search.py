"""Gauss–Newton steps that find the errors of a scene's description, and of gateways' places, from received powers."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float

from learn.twin.gauss_newton import ROUNDS, SMALL, TINY, halved_to_valid
from learn.twin.linearised import Quadratic, by_materials, correlation, linearised, moved
from learn.twin.power_likelihood import DB, PowerFit, PowerLikelihood
from learn.twin.starting_values import drawn_poses, responses_of
from scenes.checks.validation import is_valid
from scenes.scene.description import Scene
from scenes.scene.unknowns import Unknown, vary
from simulate.rays.tracer import Tracer


class PowerMinimum(NamedTuple):
    """The end of a search: the values, their deviations, −2 log of the posterior, the fit, and the tracers."""

    values: Float[np.ndarray, " n"]
    deviations: Float[np.ndarray, " n"]
    unlikely: float
    fit: PowerFit
    tracers: list[Tracer]


@dataclass(frozen=True)
class PowerSearch:
    """A search for the most likely values of the unknowns, given received powers."""

    scenes: Mapping[str, Scene]  # the scene as described with each gateway alone, by the gateway's name
    which: Sequence[Unknown]  # n unknowns. Those of a gateway's position have its name.
    positions: Float[np.ndarray, "K 3"]  # transmitter positions, metres, world frame
    likelihood: PowerLikelihood  # that of the received powers
    report: Callable[[str], None]  # called with sentences on the progress

    @property
    def prior(self) -> Float[np.ndarray, " n"]:
        """Standard deviations of the unknowns' priors."""
        return np.array([each.tolerance for each in self.which])

    def own(self, gateway: str) -> list[int]:
        """Numbers of the unknowns that concern a gateway's powers: its own, and those of the place."""
        return [number for number, each in enumerate(self.which) if each.kind != "position" or each.name == gateway]

    def varied(self, values: Float[np.ndarray, " n"]) -> list[Scene]:
        """The scenes with changed unknowns."""
        result = []
        for name, scene in self.scenes.items():
            own = self.own(name)
            result.append(vary(scene, [self.which[each] for each in own], values[own]))
        return result

    def start_nearby(self, tracers: Sequence[Tracer]) -> Float[np.ndarray, " n"]:
        """The unknowns with the most likely of many drawn positions of each gateway; all else as described."""
        result = np.zeros(len(self.which))
        for column, (name, tracer) in enumerate(zip(self.scenes, tracers, strict=True)):
            places = [each for each in self.own(name) if self.which[each].kind == "position"]
            unknown = [self.which[each] for each in places]
            if not unknown:
                continue
            guesses = drawn_poses(unknown)
            gains = np.abs(responses_of(tracer, unknown, self.positions, guesses)[..., 0]) ** 2
            unlikely = self.likelihood.of_guesses(column, gains)
            unlikely = unlikely + ((guesses / self.prior[places]) ** 2).sum(axis=1)
            for number in np.argsort(unlikely, kind="stable"):
                if is_valid(vary(self.scenes[name], unknown, guesses[number])):
                    result[places] = guesses[number]
                    break
        return result

    def minimum(self, tracers: Sequence[Tracer], start: Float[np.ndarray, " n"]) -> PowerMinimum:
        """The minimum to which steps from some values lead."""
        region = np.stack([self.positions.min(axis=0), self.positions.max(axis=0)])
        best: PowerMinimum | None = None
        model, step, reach = None, np.zeros(len(self.which)), np.inf
        for number in range(ROUNDS):
            values = start if best is None else best.values
            if model is not None:
                step = halved_to_valid(values, model.step(reach), self._is_valid)
                if np.abs(step / self.prior).max() < SMALL:
                    break
                values = values + step
            pairs = zip(tracers, self.varied(values), strict=True)
            tracers = [moved(tracer, scene, region) for tracer, scene in pairs]
            responses, jacobian = self._linearised(tracers)
            fit = self.likelihood.best(np.abs(responses) ** 2)
            unlikely = float(fit.unlikely.sum() + ((values / self.prior) ** 2).sum())
            self.report(f"round {number + 1} of at most {ROUNDS}: median error {self.error(fit):.2f} dB")
            if model is not None and best is not None:
                reach = model.next_reach(step, reach, best.unlikely - unlikely)
                if unlikely > best.unlikely:
                    continue
            jacobian = jacobian + self._by_materials(tracers, responses)
            model = self._quadratic(fit, responses, jacobian, values)
            best = PowerMinimum(values, model.deviations, unlikely, fit, list(tracers))
        assert best is not None
        return best

    def error(self, fit: PowerFit) -> float:
        """Median absolute error of the powers that were received, dB."""
        return float(np.nanmedian(np.abs(self.likelihood.powers - fit.expected)))

    def responses(self, tracers: Sequence[Tracer]) -> Complex[np.ndarray, "K G"]:
        """Traced responses of the gateways."""
        return np.concatenate([each.responses(self.positions).astype(complex) for each in tracers], axis=1)

    def _linearised(self, tracers: Sequence[Tracer]) -> tuple[Complex[np.ndarray, "K G"], Complex[np.ndarray, "K G n"]]:
        responses = np.zeros((len(self.positions), len(tracers)), complex)
        jacobian = np.zeros((*responses.shape, len(self.which)), complex)
        for column, (name, tracer) in enumerate(zip(self.scenes, tracers, strict=True)):
            own = self.own(name)
            found, slopes = linearised(tracer, [self.which[each] for each in own], self.positions)
            responses[:, column], jacobian[:, column, own] = found[:, 0], slopes[:, 0]
        return responses, jacobian

    def _by_materials(
        self, tracers: Sequence[Tracer], responses: Complex[np.ndarray, "K G"]
    ) -> Complex[np.ndarray, "K G n"]:
        columns = [
            by_materials(tracer, self.which, self.positions, responses[:, [column]])
            for column, tracer in enumerate(tracers)
        ]
        return np.concatenate(columns, axis=1)

    def _quadratic(
        self,
        fit: PowerFit,
        responses: Complex[np.ndarray, "K G"],
        jacobian: Complex[np.ndarray, "K G n"],
        values: Float[np.ndarray, " n"],
    ) -> Quadratic:
        """−2 log of the posterior to second order. With each step, the levels of the gateways follow."""
        slopes = 2 * DB * (responses.conj()[..., None] * jacobian).real / fit.softened[..., None] * self.prior
        precision = np.einsum("kg,kgi,kgj->ij", fit.curvatures, slopes, slopes) + np.eye(len(self.prior))
        by_level = np.einsum("kg,kgi->gi", fit.curvatures, slopes)
        sizes = np.maximum(fit.curvatures.sum(axis=0), TINY)
        precision -= np.einsum("gi,gj,g->ij", by_level, by_level, 1 / sizes)
        towards = np.einsum("kg,kgi->i", fit.slopes, slopes) - values / self.prior
        return Quadratic(precision, towards, self.prior)

    def _is_valid(self, values: Float[np.ndarray, " n"]) -> bool:
        return all(map(is_valid, self.varied(values)))


def independence(positions: Float[np.ndarray, "K 3"], wavelength: float) -> Float[np.ndarray, " K"]:
    """How much each position counts beside the others: 1 / Σ ρ², with the correlation ρ of the twin's errors."""
    return 1 / (correlation(positions, wavelength) ** 2).sum(axis=1)
