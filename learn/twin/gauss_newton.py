"""Gauss–Newton steps with priors that find the errors of a scene's description, whatever was measured in it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple, Protocol

import numpy as np
from jaxtyping import Bool, Complex, Float, Int
from scipy.optimize import brentq

from learn.twin.linearised import CARRIER, by_materials, linearised, moved, over_band
from learn.twin.starting_values import Draws
from scenes.checks.validation import is_valid
from scenes.files.errors import InputError
from scenes.scene.description import Scene
from scenes.scene.unknowns import OF_POSE, Unknown, vary
from simulate.rays.tracer import Tracer

ROUNDS = 24  # Largest number of times that one search traces the scene

SMALL, NEAR = 0.05, 0.5
"""Standard deviations. A search ends when a step moves no unknown by more; ``NEAR`` if another stage follows."""

TINY = 1e-9  # A step that has been halved to less than this, in the unknowns' units, is given up

APART = 1 / 8
"""Wavelengths. A guess of the gateways' positions that is closer to the end of a search would lead to the same end."""

POOR, GOOD = 0.25, 0.75
"""Shares of the gain that was expected of a step. Below the first, the next step is half as long; above the second, it
may be longer."""


class Residual(Protocol):
    """Measured values of one quantity, and how likely traced responses make them.

    A fit has −2 log of the likelihood, ``unlikely``, in all or of each gateway, and ``misfit``, a number for a reader.
    """

    @property
    def compared(self) -> Int[np.ndarray, " k"]:
        """Numbers of the positions at which guesses are compared."""

    def fit(self, traced: Complex[np.ndarray, "K M"]) -> Any:
        """The measured values beside traced responses, with the most likely gains and noise."""

    def in_words(self, misfit: float) -> str:
        """A fit's misfit for a reader."""

    def quadratic(
        self, fit: Any, traced: Complex[np.ndarray, "K M"], jacobian: Complex[np.ndarray, "K M n"]
    ) -> tuple[Float[np.ndarray, "n n"], Float[np.ndarray, " n"]]:
        """A and b in −2 log likelihood = constant − 2 b·δ + δ·A δ, for responses that are linear in δ."""

    def of_guesses(self, gateway: int, found: Complex[np.ndarray, "G k M"]) -> Float[np.ndarray, " G"]:
        """−2 log of the likelihood of one gateway's values for each of G guesses, at the compared positions."""


@dataclass(frozen=True)
class Quadratic:
    """−2 log of the posterior near some values, to second order in a step δ: ``constant − 2 b·δ + δ·A δ``."""

    precision: Float[np.ndarray, "n n"]  # A, with the unknowns in standard deviations of their priors
    towards: Float[np.ndarray, " n"]  # b
    prior: Float[np.ndarray, " n"]  # these standard deviations

    @property
    def deviations(self) -> Float[np.ndarray, " n"]:
        """Posterior standard deviations of the unknowns."""
        return self.prior * np.sqrt(np.diag(np.linalg.inv(self.precision)))

    def step(self, reach: float) -> Float[np.ndarray, " n"]:
        """The step of at most a given length that leads to the smallest value (Levenberg–Marquardt).

        It is δ = (A + μ)⁻¹ b, with the smallest damping μ ≥ 0 for which its length is at most ``reach``.
        """
        sizes, axes = np.linalg.eigh(self.precision)
        along = axes.T @ self.towards

        def longer(damping: float) -> float:
            return float(np.linalg.norm(along / (sizes + damping))) - reach

        damping = brentq(longer, 0, np.linalg.norm(along) / reach) if longer(0) > 0 else 0.0
        return self.prior * (axes @ (along / (sizes + damping)))

    def next_reach(self, step: Float[np.ndarray, " n"], reach: float, gained: float) -> float:
        """How long the next step may be: longer if the responses were as linear as assumed."""
        scaled = step / self.prior
        length = float(np.linalg.norm(scaled))
        expected = float(2 * self.towards @ scaled - scaled @ self.precision @ scaled)
        if gained < POOR * expected:
            return length / 2
        return max(reach, 2 * length) if gained > GOOD * expected else reach


class Minimum(NamedTuple):
    """The end of a search."""

    values: Float[np.ndarray, " n"]
    deviations: Float[np.ndarray, " n"]
    tracers: list[Tracer]  # of the scenes with these values
    unlikely: float = np.inf  # −2 log of the posterior
    fit: Any = None  # that of the last residual; None: no path reached any position


@dataclass(frozen=True)
class Search:
    """A search for the most likely values of a description's unknowns."""

    # of the scene as described, with each gateway alone, by the gateway's name in the unknowns
    tracers: Mapping[str, Tracer]
    which: list[Unknown]  # n unknowns
    positions: Float[np.ndarray, "K 3"]  # of the transmitter, metres, world frame
    stages: Sequence[Residual]  # what each stage of a search compares; it begins where the one before ended
    report: Callable[[str], None]  # called with sentences on the progress
    ratios: Sequence[float] = CARRIER  # frequencies of the responses, in carrier frequencies
    far: bool = False  # whether a gateway may be so far from its described place that the scene is traced elsewhere

    @property
    def prior(self) -> Float[np.ndarray, " n"]:
        """Standard deviations of the unknowns' priors."""
        return np.array([each.tolerance for each in self.which])

    def own(self, gateway: str) -> Bool[np.ndarray, " n"]:
        """Which unknowns concern what a gateway receives: those of its pose, and those of the place."""
        return np.array([each.kind not in OF_POSE or each.name == gateway for each in self.which])

    def varied(self, values: Float[np.ndarray, " n"]) -> list[Scene]:
        """The scenes with changed unknowns."""
        tracers = self.tracers.items()
        return [vary(each.scene, self.which, np.where(self.own(name), values, 0)) for name, each in tracers]

    def is_valid(self, values: Float[np.ndarray, " n"]) -> bool:
        """Whether all scenes with changed unknowns are valid."""
        return all(map(is_valid, self.varied(values)))

    def most_likely(self) -> Minimum:
        """The more likely end of two searches: from the description, and from the most likely drawn poses."""
        tracers = list(self.tracers.values())
        found = self.from_start(tracers, np.zeros(len(self.which)))
        guess = self.drawn()
        where = [number for number, each in enumerate(self.which) if each.kind == "position"]
        elsewhere = np.linalg.norm((guess - found.values)[where]) > APART * tracers[0].scene.wavelength
        if guess.any() and (elsewhere or not where):
            pairs = zip(tracers, self.varied(guess), strict=True)
            if self.far:  # the chains there are others
                there = [Tracer(scene, each.ray_scene.propagation, each.region) for each, scene in pairs]
            else:
                there = [moved(each, scene) for each, scene in pairs]
            found = min(found, self.from_start(there, guess), key=lambda end: end.unlikely)
        return found

    def drawn(self) -> Float[np.ndarray, " n"]:
        """The unknowns with the most likely of many drawn poses of each gateway; all else as described."""
        values, residual = np.zeros(len(self.which)), self.stages[0]
        for number, (name, tracer) in enumerate(self.tracers.items()):
            own = np.flatnonzero(self.own(name))
            unknowns = [self.which[each] for each in own]
            if any(each.kind in OF_POSE for each in unknowns):
                unlikely = partial(residual.of_guesses, number)
                draws = Draws(tracer.scene, unknowns, self.positions[residual.compared], unlikely, self.ratios)
                values[own] += draws.far_away(tracer) if self.far else draws.nearby(tracer)
        return values

    def from_start(self, tracers: list[Tracer], start: Float[np.ndarray, " n"]) -> Minimum:
        """The minimum to which a search in stages leads from some values."""
        end = Minimum(start, self.prior, tracers)
        for residual in self.stages:
            small = SMALL if residual is self.stages[-1] else NEAR
            end = self.minimum(Minimum(end.values, self.prior, end.tracers), residual, small)
        return end

    def minimum(self, best: Minimum, residual: Residual, small: float) -> Minimum:
        """The minimum to which steps from some values lead."""
        tracers, prior = best.tracers, self.prior
        model, step, reach = None, np.zeros(len(prior)), np.inf
        for number in range(ROUNDS):
            values = best.values
            if model is not None:
                step = halved_to_valid(values, model.step(reach), self.is_valid)
                if np.abs(step / prior).max() < small:
                    break
                values = values + step
                tracers = [moved(*each) for each in zip(tracers, self.varied(values), strict=True)]
            band = self.over_band(tracers)
            parts = [linearised(each, self.which, self.positions, name) for name, each in band]
            traced, jacobian = (np.concatenate(each, axis=1) for each in zip(*parts, strict=True))
            if not traced.any():
                if model is None:
                    break
                reach = model.next_reach(step, reach, gained=-np.inf)
                continue
            fit = residual.fit(traced)
            self.report(f"round {number + 1} of at most {ROUNDS}: {residual.in_words(fit.misfit)}")
            unlikely = float(np.sum(fit.unlikely) + ((values / prior) ** 2).sum())
            if model is not None:
                reach = model.next_reach(step, reach, best.unlikely - unlikely)
            if unlikely > best.unlikely:
                continue
            of_each = zip(band, np.split(traced, len(band), axis=1), strict=True)
            by_each = [by_materials(each, self.which, self.positions, responses) for (_, each), responses in of_each]
            jacobian = jacobian + np.concatenate(by_each, axis=1)
            precision, towards = residual.quadratic(fit, traced, jacobian * prior)
            model = Quadratic(precision + np.eye(len(prior)), towards - values / prior, prior)
            best = Minimum(values, model.deviations, tracers, unlikely, fit)
        return best

    def over_band(self, tracers: Iterable[Tracer]) -> list[tuple[str, Tracer]]:
        """The tracer of each gateway and frequency, with the gateway's name."""
        pairs = zip(self.tracers, tracers, strict=True)
        return [(name, each) for name, tracer in pairs for each in over_band(tracer, self.ratios)]


def halved_to_valid(
    values: Float[np.ndarray, " n"], step: Float[np.ndarray, " n"], valid: Callable[[Float[np.ndarray, " n"]], bool]
) -> Float[np.ndarray, " n"]:
    """A step, halved until it leads to valid scenes; zero if no such step is found."""

    def reaches(there: Float[np.ndarray, " n"]) -> bool:
        try:
            return valid(there)
        except InputError:
            return False

    while step.any() and not reaches(values + step):
        step = np.where(np.abs(step) > TINY, step / 2, 0)
    return step
