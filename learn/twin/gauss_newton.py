"""Gauss–Newton steps with priors that find the errors of a scene's description from measured responses."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float
from scipy.linalg import cho_factor

from learn.twin.gains import aligned_to, unexplained, without_own_phase
from learn.twin.linearised import (
    CARRIER,
    Quadratic,
    by_materials,
    correlation,
    linearised,
    moved,
    over_band,
    unlikelihood,
)
from learn.twin.starting_values import is_far, start_far_away, start_nearby
from scenes.checks.validation import is_valid
from scenes.files.errors import InputError
from scenes.files.long_work import doing
from scenes.scene.description import Scene
from scenes.scene.unknowns import Unknown, vary
from simulate.rays.core.propagation import Propagation
from simulate.rays.tracer import Tracer

ROUNDS = 24  # Largest number of times that one search traces the scene

SMALL, NEAR = 0.05, 0.5
"""Standard deviations. A search ends when a step moves no unknown by more; ``NEAR`` if another search follows."""

TINY = 1e-9  # A step that has been halved to less than this, in the unknowns' units, is given up

COUNTED = 160
"""Largest number of responses that count as independent: those of ten positions with sixteen elements. An error of the
rays, such as that of a surface that scatters more than they assume, is the same at all positions."""

APART = 1 / 8
"""Wavelengths. A guess of the gateway's position that is closer to the end of a search would lead to the same end."""


@dataclass(frozen=True)
class Calibration:
    """A corrected scene, and how certain its n corrections are.

    Attributes:
        scene: the corrected scene.
        which: what may have been wrong: n numbers, each with a ``label`` for a reader and its ``tolerance``.
        values: [n] the corrections: metres, radians, or the logarithm of a ratio.
        deviations: [n] their standard deviations after the spectra were seen, in the same units.
        gain: common complex gain of the measured responses over the traced ones.
        misfit: share of the measured power, 0…1, that the corrected scene does not explain, and the same of the scene
            as described.
    """

    scene: Scene
    which: list[Unknown]
    values: Float[np.ndarray, " n"]
    deviations: Float[np.ndarray, " n"]
    gain: complex
    misfit: tuple[float, float]


def most_likely(
    scene: Scene,
    which: Sequence[Unknown],
    propagation: Propagation,
    positions: Float[np.ndarray, "K 3"],
    measured: Complex[np.ndarray, "K M"],
    phases_known: bool,
    report: Callable[[str], None] = lambda sentence: None,
    ratios: Sequence[float] = CARRIER,
) -> Calibration:
    """Correct a scene so that its responses fit measured ones.

    The difference that remains is taken to be a Gaussian field that solves the wave equation, correlated within half a
    wavelength, plus noise. A hundred positions within a wavelength therefore do not count as a hundred measurements.
    Also, no more than ``COUNTED`` responses count as independent, since errors of the rays themselves do not average
    out.
    """
    if not measured.any():
        raise InputError(f"{scene.name}: expected spectra of several grey levels, found none")
    # Only responses behind pictures may be flipped, even while others are compared in phases of their own.
    flips = not phases_known and scene.gateway.elements is None  # elements at given places have no such symmetry
    doing(f"{scene.name}: correcting {len(which)} values by {len(positions):,} spectra, in {ROUNDS} rounds at most")
    search = _Search(scene, list(which), positions, measured, flips=flips, report=report, ratios=ratios)
    tracer = Tracer(scene, propagation, search.region, report=report)
    band = over_band(tracer, ratios)
    described = np.concatenate([each.responses(positions).astype(complex) for each in band], axis=1)
    if not described.any():
        raise InputError(f"{scene.name}: expected paths from the gateway to the positions of the spectra, found none")
    counted = min(measured.size, COUNTED)
    found = search.from_start(tracer, np.zeros(len(which)), phases_known, counted)
    far = is_far(scene, which)
    if far:
        guess = start_far_away(tracer, ratios, which, positions, measured, search.flips, counted)
    else:
        guess = start_nearby(band, which, positions, measured, search.flips, counted)
    where = [number for number, each in enumerate(which) if each.kind == "position"]
    elsewhere = np.linalg.norm((guess - found.values)[where]) > APART * scene.wavelength
    if guess.any() and (elsewhere or not where):
        there = vary(scene, which, guess)
        nearby = Tracer(there, propagation, search.region) if far else moved(tracer, there, search.region)
        other = search.from_start(nearby, guess, phases_known, counted)
        found = min(found, other, key=lambda end: end.unlikely)
    aligned, _ = aligned_to(measured, described, phases_known, search.flips)
    before = unexplained(without_own_phase(aligned - described, described, phases_known), aligned)
    corrected = vary(scene, which, found.values)
    return Calibration(corrected, list(which), found.values, found.deviations, found.gain, (found.misfit, before))


class _Minimum(NamedTuple):
    """The end of a search: fields of ``Calibration``, −2 log of the posterior, and a tracer of the scene."""

    values: Float[np.ndarray, " n"]
    deviations: Float[np.ndarray, " n"]
    gain: complex
    misfit: float
    unlikely: float
    tracer: Tracer


@dataclass(frozen=True)
class _Search:
    """Gauss–Newton steps to the most likely values of a scene's unknowns."""

    scene: Scene
    which: list[Unknown]
    positions: Float[np.ndarray, "K 3"]
    measured: Complex[np.ndarray, "K M"]
    flips: bool
    report: Callable[[str], None]
    ratios: Sequence[float] = CARRIER

    @property
    def region(self) -> Float[np.ndarray, "2 3"]:
        """Lowest and highest corner of the box that the positions are in."""
        return np.stack([self.positions.min(axis=0), self.positions.max(axis=0)])

    def from_start(self, tracer: Tracer, start: Float[np.ndarray, " n"], phases_known: bool, counted: int) -> _Minimum:
        """The minimum to which a search from some values leads. If phases are known, it ignores them at first.

        A gateway half a wavelength nearer to a wall, with the opposite common gain, can be a minimum too. Responses
        that are each compared in a phase of their own have no common gain, and lead close to the right minimum.
        """
        if not phases_known:
            return self.minimum(tracer, start, False, SMALL, counted)
        near = self.minimum(tracer, start, False, NEAR, counted)
        return self.minimum(near.tracer, near.values, True, SMALL, counted)

    def minimum(
        self,
        tracer: Tracer,
        start: Float[np.ndarray, " n"],
        phases_known: bool,
        small: float,
        counted: int,
    ) -> _Minimum:
        """The minimum to which steps from some values lead."""
        scene, which, prior = self.scene, self.which, np.array([each.tolerance for each in self.which])
        alike = cho_factor(correlation(self.positions, scene.wavelength), lower=True)
        freely = "" if phases_known else " (each spectrum with a separate phase)"
        best = _Minimum(start, prior, 1 + 0j, 1.0, np.inf, tracer)
        model, step, reach = None, np.zeros(len(which)), np.inf
        for number in range(ROUNDS):
            values = best.values
            if model is not None:
                step = halved_to_valid(values, model.step(reach), self._is_valid)
                if np.abs(step / prior).max() < small:
                    break
                values = values + step
                tracer = moved(tracer, vary(scene, which, values), self.region)
            band = over_band(tracer, self.ratios)
            parts = [linearised(each, which, self.positions) for each in band]
            traced, jacobian = (np.concatenate(each, axis=1) for each in zip(*parts, strict=True))
            if not traced.any():
                if model is None:
                    break
                reach = model.next_reach(step, reach, gained=-np.inf)
                continue
            aligned, gain = aligned_to(self.measured, traced, phases_known, self.flips)
            rest = without_own_phase(aligned - traced, traced, phases_known)
            misfit = unexplained(rest, aligned)
            self.report(f"round {number + 1} of at most {ROUNDS}: {misfit:.2%} of the power unexplained{freely}")
            unlikely = unlikelihood(alike, rest, aligned, counted) + float(((values / prior) ** 2).sum())
            if model is not None:
                reach = model.next_reach(step, reach, best.unlikely - unlikely)
            if unlikely > best.unlikely:
                continue
            of_each = zip(band, np.split(traced, len(band), axis=1), strict=True)
            of_materials = [by_materials(each, which, self.positions, responses) for each, responses in of_each]
            jacobian = jacobian + np.concatenate(of_materials, axis=1)
            jacobian = without_own_phase(jacobian, traced, phases_known)
            model = Quadratic.of(alike, rest, jacobian, traced, values, prior, counted)
            best = _Minimum(values, model.deviations, gain, misfit, unlikely, tracer)
        return best

    def _is_valid(self, values: Float[np.ndarray, " n"]) -> bool:
        return is_valid(vary(self.scene, self.which, values))


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
