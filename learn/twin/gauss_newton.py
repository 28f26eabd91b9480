"""Find what a scene's description has wrong from measured responses, by Gauss–Newton steps with priors."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float
from scipy.linalg import cho_factor, cho_solve

from learn.twin.alignment import aligned_to, unexplained, without_own_phase
from learn.twin.first_guess import first_guess
from learn.twin.linearised import by_materials, linearised
from scenes.description import Scene
from scenes.errors import InputError
from scenes.unknowns import Unknown, varied
from scenes.validation import is_valid
from simulate.propagation import Propagation
from simulate.trace import Found, Tracer

ROUNDS = 16
"""Largest number of Gauss–Newton steps."""

SMALL, NEAR = 0.05, 0.5
"""Standard deviations: a search ends when no unknown moves by more in a step; ``NEAR`` where another one follows."""

TINY = 1e-9
"""Of a step, in the unknowns' units: a step that is as small has been halved in vain."""

UNCORRELATED = 0.1
"""Share of what the twin gets wrong that differs from place to place, with the noise."""

COUNTED = 160
"""Largest number of responses that count as independent, ten positions of sixteen elements: an error of the rays, such
as a surface that scatters more than they know, is the same at all positions."""

LENGTH = 1.0
"""Metres over which the waves that the twin lacks stay alike."""


@dataclass(frozen=True)
class Calibration:
    """A corrected scene, and how sure its corrections are.

    Attributes:
        scene: the corrected scene.
        which: its unknowns.
        values: by how much each was changed.
        deviations: posterior standard deviation of each, in the same units.
        gain: common complex gain of measured over traced responses.
        misfit: share of the measured power that the corrected twin leaves unexplained, and that the first one did.
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
) -> Calibration:
    """Correct a scene so that its responses fit measured ones.

    What the corrected twin leaves is taken for a Gaussian field that solves the wave equation, alike within half a
    wavelength, plus noise: so that a hundred positions within a wavelength do not count as a hundred measurements. And
    no more than ``COUNTED`` responses count, since errors of the rays themselves do not average out.

    Args:
        scene: the scene as described.
        which: what may be wrong with it.
        propagation: the mechanisms that rays follow.
        positions: of the transmitters, metres, world frame.
        measured: element responses.
        phases_known: whether responses of different positions share phase and scale. Otherwise, as behind pictures,
            each has its own, and may be flipped (y_m → conj y_{M−1−m}).
        report: called with sentences on the progress.

    Raises:
        InputError: all responses are zero, or no path reaches any of the positions.
    """
    if not measured.any():
        raise InputError(f"{scene.name}: expected spectra with some power to correct the scene by, found none")
    # Responses behind pictures may be flipped. Others may not, also while they are compared in phases of their own.
    search = _Search(scene, list(which), positions, measured, flips=not phases_known, report=report)
    tracer = Tracer(scene, propagation, search.region, report=report)
    described = tracer.responses(positions).astype(complex)
    if not described.any():
        raise InputError(f"{scene.name}: expected paths from the gateway to the spectra, found none")
    counted = min(measured.size, COUNTED)
    # A gateway half a wavelength nearer to a wall, with the opposite common gain, can be a minimum, too. Responses that
    # are compared in a phase of their own each have no common gain, and lead near the right minimum. On the way there
    # all of them count: the prior would otherwise hold the search back in minima near the description.
    near = search.minimum(tracer, np.zeros(len(which)), phases_known=False, small=NEAR, counted=measured.size)
    guess = first_guess(tracer, which, positions, measured, search.flips, counted)
    if guess.any():
        nearby = moved(tracer, varied(scene, which, guess), search.region)
        other = search.minimum(nearby, guess, phases_known=False, small=NEAR, counted=measured.size)
        near = min(near, other, key=lambda end: end.unlikely)
    found = search.minimum(near.tracer, near.values, phases_known, SMALL, counted)
    aligned, _ = aligned_to(measured, described, phases_known)
    before = unexplained(without_own_phase(aligned - described, described, phases_known), aligned)
    corrected = varied(scene, which, found.values)
    return Calibration(corrected, list(which), found.values, found.deviations, found.gain, (found.misfit, before))


class _Minimum(NamedTuple):
    """Where a search ended, −2 log of the posterior there, and a tracer of the scene; else as of ``Calibration``."""

    values: Float[np.ndarray, " n"]
    deviations: Float[np.ndarray, " n"]
    gain: complex
    misfit: float
    unlikely: float
    tracer: Tracer


@dataclass(frozen=True)
class _Search:
    """Gauss–Newton steps to the most likely values of a scene's unknowns.

    Attributes: see ``most_likely``; ``flips``: whether responses may be flipped, where phases are not known.
    """

    scene: Scene
    which: list[Unknown]
    positions: Float[np.ndarray, "K 3"]
    measured: Complex[np.ndarray, "K M"]
    flips: bool
    report: Callable[[str], None]

    @property
    def region(self) -> Float[np.ndarray, "2 3"]:
        """Lowest and highest corner of the box that the positions are in."""
        return np.stack([self.positions.min(axis=0), self.positions.max(axis=0)])

    def minimum(
        self,
        tracer: Tracer,
        start: Float[np.ndarray, " n"],
        phases_known: bool,
        small: float,
        counted: int,
    ) -> _Minimum:
        """The minimum that steps from some values lead to.

        Args:
            tracer: of the scene with these values.
            start: the values.
            phases_known: as of ``most_likely``.
            small: step, in standard deviations of the prior, at which the search ends.
            counted: number of responses that count as independent.
        """
        scene, which, prior = self.scene, self.which, np.array([each.tolerance for each in self.which])
        alike = cho_factor(_alike(self.positions, scene.wavelength), lower=True)
        freely = "" if phases_known else ", with a phase of its own for each spectrum"
        step = np.zeros(len(which))
        best = _Minimum(start, prior, 1 + 0j, 1.0, np.inf, tracer)
        for number in range(ROUNDS):
            values = best.values
            if number:
                step = self._halved_to_valid(values, step)
                if np.abs(step / prior).max() < small:
                    break
                values = values + step
                tracer = moved(tracer, varied(scene, which, values), self.region)
            traced, jacobian = linearised(tracer, which, self.positions)
            if not traced.any():
                step = step / 2
                continue
            aligned, gain = aligned_to(self.measured, traced, phases_known, self.flips)
            rest = without_own_phase(aligned - traced, traced, phases_known)
            misfit = unexplained(rest, aligned)
            self.report(f"round {number + 1}: {misfit:.2%} of the power unexplained{freely}")
            unlikely = unlikelihood(alike, rest, aligned, counted) + float(((values / prior) ** 2).sum())
            if unlikely > best.unlikely:
                step = step / 2
                continue
            jacobian = jacobian + by_materials(tracer, which, self.positions, traced)
            jacobian = without_own_phase(jacobian, traced, phases_known)
            step, deviations = _step(alike, rest, jacobian, traced, values, prior, counted)
            best = _Minimum(values, deviations, gain, misfit, unlikely, tracer)
        return best

    def _halved_to_valid(
        self, values: Float[np.ndarray, " n"], step: Float[np.ndarray, " n"]
    ) -> Float[np.ndarray, " n"]:
        """A step from some values, halved until the scene is valid, with the gateway in the open; zero if none is."""
        while step.any() and not self._is_valid(values + step):
            step = np.where(np.abs(step) > TINY, step / 2, 0)
        return step

    def _is_valid(self, values: Float[np.ndarray, " n"]) -> bool:
        try:
            return is_valid(varied(self.scene, self.which, values))
        except InputError:  # a material out of its range
            return False


def unlikelihood(
    alike: tuple[np.ndarray, bool],
    rest: Complex[np.ndarray, "K M"],
    aligned: Complex[np.ndarray, "K M"],
    counted: int,
) -> float:
    """−2 log of the likelihood of measured responses, but for a constant; the noise has its most likely variance.

    Args:
        alike: factors of the correlation of what the twin leaves.
        rest: what it leaves.
        aligned: measured responses in the traced ones' scale. What is left counts relative to their power, since the
            scale of the traced responses is a free gain and must not matter.
        counted: number of responses that count as independent.
    """
    left = (rest.conj() * cho_solve(alike, rest)).real.sum() / (np.abs(aligned) ** 2).sum()
    return 2 * counted * float(np.log(left))


def moved(tracer: Tracer, scene: Scene, region: Float[np.ndarray, "2 3"]) -> Tracer:
    """A tracer of a scene that differs a little from another one's, with that one's chains as far as they serve."""
    edges, old = tracer.edges, tracer.ray_scene
    new = Tracer(scene, old.propagation, region, found=tracer.found)
    if not np.array_equal(new.ray_scene.planes.of_face, old.planes.of_face):  # flush objects have come apart
        return Tracer(scene, old.propagation, region)
    if new.edges is None or edges is None or np.array_equal(new.edges.faces, edges.faces):
        return new
    return Tracer(scene, old.propagation, region, found=Found(tracer.found.reflected, None))


def _step(
    alike: tuple[np.ndarray, bool],
    rest: Complex[np.ndarray, "K M"],
    jacobian: Complex[np.ndarray, "K M n"],
    traced: Complex[np.ndarray, "K M"],
    values: Float[np.ndarray, " n"],
    prior: Float[np.ndarray, " n"],
    counted: int,
) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, " n"]]:
    """The Gauss–Newton step of the unknowns, and their posterior standard deviations.

    Args:
        alike: factors of the correlation of what the twin leaves.
        rest: what it leaves.
        jacobian: derivatives of the responses by the unknowns.
        traced: the responses; their common gain is one more unknown, of which nothing is known.
        values: by how much these have been changed.
        prior: their standard deviations beforehand.
        counted: number of responses that count as independent.
    """
    columns = np.concatenate([jacobian, traced[..., None], 1j * traced[..., None]], axis=-1)
    together = np.concatenate([rest[..., None], columns], axis=-1).reshape(len(rest), -1)
    solved = cho_solve(alike, together).reshape(*rest.shape, -1)
    variance = (rest.conj() * solved[..., 0]).real.sum() / counted / 2  # of the real part, and of the imaginary one
    normal = np.einsum("kmi,kmj->ij", columns.conj(), solved[..., 1:]).real / variance
    towards = np.einsum("kmi,km->i", columns.conj(), solved[..., 0]).real / variance
    number = len(prior)
    known = np.zeros(number + 2)
    known[:number] = prior**-2
    towards[:number] -= values * known[:number]
    covariance = np.linalg.inv(normal + np.diag(known))
    return (covariance @ towards)[:number], np.sqrt(np.diag(covariance)[:number])


def _alike(positions: Float[np.ndarray, "K 3"], wavelength: float) -> Float[np.ndarray, "K K"]:
    """Correlation of what the twin leaves at two positions: sin(kΔ)/kΔ, fading over ``LENGTH``, plus noise."""
    apart = np.linalg.norm(positions[:, None] - positions, axis=-1)
    waves = np.sinc(2 * apart / wavelength) * np.exp(-apart / LENGTH)
    return (1 - UNCORRELATED) * waves + UNCORRELATED * np.eye(len(positions))
