"""Responses to first order in the errors of a scene's description, and −2 log of their posterior to second order.

The difference between measured and traced responses is assumed to be a Gaussian field plus noise. The scene's unknowns
have normal priors.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Float
from scipy.linalg import cho_solve
from scipy.optimize import brentq

from scenes.scene.description import Scene
from scenes.scene.unknowns import OF_MATERIALS, Unknown, vary
from simulate.rays.chain_solver import Found
from simulate.rays.derivatives import derivatives
from simulate.rays.tracer import Tracer

STEP = 0.02  # Step of the finite differences, in the logarithm of a material's property


CARRIER = (1.0,)  # The frequencies of responses at the carrier alone, in carrier frequencies


def over_band(tracer: Tracer, ratios: Sequence[float]) -> list[Tracer]:
    """Tracers of one scene at several frequencies; the array keeps its size in metres, materials their properties."""
    frequency = [Unknown("frequency", "", 0, 1.0)]

    def at(ratio: float) -> Tracer:
        return tracer.at_frequency(vary(tracer.ray_scene.description, frequency, np.log([ratio])))

    return [tracer if ratio == 1 else at(ratio) for ratio in ratios]


def moved(tracer: Tracer, scene: Scene, region: Float[np.ndarray, "2 3"]) -> Tracer:
    """A tracer of a scene that differs a little from another tracer's; it reuses the chains that are still valid."""
    edges, old = tracer.edges, tracer.ray_scene
    new = Tracer(scene, old.propagation, region, found=tracer.found)
    if not np.array_equal(new.ray_scene.planes.of_face, old.planes.of_face):  # objects that touched have come apart
        return Tracer(scene, old.propagation, region)
    if new.edges is None or edges is None or np.array_equal(new.edges.faces, edges.faces):
        return new
    return Tracer(scene, old.propagation, region, found=Found(tracer.found.reflected, None))


def linearised(
    tracer: Tracer, which: Sequence[Unknown], positions: Float[np.ndarray, "K 3"]
) -> tuple[Complex[np.ndarray, "K M"], Complex[np.ndarray, "K M n"]]:
    """Responses, and their derivatives by poses, places and frequency. The columns of materials are zero."""
    names = [item.name for item in tracer.ray_scene.description.objects]
    moving = sorted({names.index(each.name) for each in which if each.kind == "object"})
    exact = derivatives(tracer, positions, moving)
    jacobian = np.zeros((*exact.responses.shape, len(which)), complex)
    for column, unknown in enumerate(which):
        if unknown.kind == "object":
            jacobian[..., column] = exact.objects[:, :, moving.index(names.index(unknown.name)), unknown.axis]
        elif unknown.kind == "frequency":
            jacobian[..., column] = exact.frequency
        elif unknown.kind not in OF_MATERIALS:
            jacobian[..., column] = getattr(exact, unknown.kind)[..., unknown.axis]
    return exact.responses, jacobian


def by_materials(
    tracer: Tracer,
    which: Sequence[Unknown],
    positions: Float[np.ndarray, "K 3"],
    responses: Complex[np.ndarray, "K M"],
) -> Complex[np.ndarray, "K M n"]:
    """Derivatives with respect to materials, by finite differences over the same paths. All other columns are zero."""
    scene, jacobian = tracer.ray_scene.description, np.zeros((*responses.shape, len(which)), complex)
    columns = [column for column, unknown in enumerate(which) if unknown.kind in OF_MATERIALS]
    if not columns:
        return jacobian
    others = [vary(scene, [which[column]], np.array([STEP])) for column in columns]
    for column, traced in zip(columns, tracer.responses_with(others, positions), strict=True):
        jacobian[..., column] = (traced - responses) / STEP
    return jacobian


UNCORRELATED = 0.1
"""Share of the twin's error that is uncorrelated between positions, including the noise."""

POOR, GOOD = 0.25, 0.75
"""Shares of the gain that was expected of a step. Below the first, the next step is half as long; above the second, it
may be longer."""

LENGTH = 1.0  # Correlation length of the waves that the twin lacks, metres


def correlation(positions: Float[np.ndarray, "K 3"], wavelength: float) -> Float[np.ndarray, "K K"]:
    """Correlation of the twin's errors at two positions: sin(kΔ)/kΔ, fading over ``LENGTH``, plus noise."""
    apart = np.linalg.norm(positions[:, None] - positions, axis=-1)
    waves = np.sinc(2 * apart / wavelength) * np.exp(-apart / LENGTH)
    return (1 - UNCORRELATED) * waves + UNCORRELATED * np.eye(len(positions))


def unlikelihood(
    alike: tuple[np.ndarray, bool],
    rest: Complex[np.ndarray, "K M"],
    aligned: Complex[np.ndarray, "K M"],
    counted: int,
) -> float:
    """−2 log of the likelihood of measured responses, up to a constant. The noise has its most likely variance."""
    left = (rest.conj() * cho_solve(alike, rest)).real.sum() / (np.abs(aligned) ** 2).sum()
    return 2 * counted * float(np.log(left))


@dataclass(frozen=True)
class Quadratic:
    """−2 log of the posterior near some values, to second order in a step δ: ``constant − 2 b·δ + δ·A δ``."""

    precision: Float[np.ndarray, "n n"]  # A, with the unknowns in standard deviations of their priors
    towards: Float[np.ndarray, " n"]  # b
    prior: Float[np.ndarray, " n"]  # these standard deviations

    @classmethod
    def of(
        cls,
        alike: tuple[np.ndarray, bool],
        rest: Complex[np.ndarray, "K M"],
        jacobian: Complex[np.ndarray, "K M n"],
        traced: Complex[np.ndarray, "K M"],
        values: Float[np.ndarray, " n"],
        prior: Float[np.ndarray, " n"],
        counted: int,
    ) -> Quadratic:
        """The quadratic for responses that are linear in the unknowns (Gauss–Newton).

        If each position has a separate phase and scale, it is an approximation, since the measured responses take the
        scale of the traced ones, which depends on the unknowns.
        """
        columns = np.concatenate([jacobian * prior, traced[..., None], 1j * traced[..., None]], axis=-1)
        together = np.concatenate([rest[..., None], columns], axis=-1).reshape(len(rest), -1)
        solved = cho_solve(alike, together).reshape(*rest.shape, -1)
        variance = (rest.conj() * solved[..., 0]).real.sum() / counted / 2  # of the real and of the imaginary part
        normal = np.einsum("kmi,kmj->ij", columns.conj(), solved[..., 1:]).real / variance
        towards = np.einsum("kmi,km->i", columns.conj(), solved[..., 0]).real / variance
        number = len(prior)
        # With the most likely gain for each step, the Schur complement remains.
        by_gain = np.linalg.solve(normal[number:, number:], normal[number:]).T
        free, gain = normal[:number, :number], by_gain[:number]
        precision = free - gain @ normal[number:, :number] + np.eye(number)
        return cls(precision, towards[:number] - gain @ towards[number:] - values / prior, prior)

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
