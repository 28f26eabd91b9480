"""How likely changes of a scene are after measured responses: −2 log of the posterior, and steps that lower it.

What the twin leaves of the responses is taken for a Gaussian field plus noise, the scene's unknowns have normal priors.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Float
from scipy.linalg import cho_solve
from scipy.optimize import brentq

UNCORRELATED = 0.1
"""Share of what the twin gets wrong that differs from place to place, with the noise."""

POOR, GOOD = 0.25, 0.75
"""Shares of the gain that was expected of a step: below, the next one is half as long; above, it may be longer."""

LENGTH = 1.0
"""Metres over which the waves that the twin lacks stay alike."""


def correlation(positions: Float[np.ndarray, "K 3"], wavelength: float) -> Float[np.ndarray, "K K"]:
    """Correlation of what the twin leaves at two positions: sin(kΔ)/kΔ, fading over ``LENGTH``, plus noise."""
    apart = np.linalg.norm(positions[:, None] - positions, axis=-1)
    waves = np.sinc(2 * apart / wavelength) * np.exp(-apart / LENGTH)
    return (1 - UNCORRELATED) * waves + UNCORRELATED * np.eye(len(positions))


def unlikelihood(
    alike: tuple[np.ndarray, bool],
    rest: Complex[np.ndarray, "K M"],
    aligned: Complex[np.ndarray, "K M"],
    counted: int,
) -> float:
    """−2 log of the likelihood of measured responses, but for a constant; the noise has its most likely variance.

    Args:
        alike: Cholesky factor of the correlation of what the twin leaves.
        rest: what it leaves.
        aligned: measured responses in the traced ones' scale. What is left counts relative to their power, since the
            scale of the traced responses is a free gain and must not matter.
        counted: number of responses that count as independent.
    """
    left = (rest.conj() * cho_solve(alike, rest)).real.sum() / (np.abs(aligned) ** 2).sum()
    return 2 * counted * float(np.log(left))


@dataclass(frozen=True)
class Quadratic:
    """−2 log of the posterior about some values, to second order in a step δ: a constant − 2 b·δ + δ·A δ.

    Attributes:
        precision: A, with the unknowns in standard deviations of their priors.
        towards: b.
        prior: these standard deviations.
    """

    precision: Float[np.ndarray, "n n"]
    towards: Float[np.ndarray, " n"]
    prior: Float[np.ndarray, " n"]

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
        """The quadratic that follows if the responses are linear in the unknowns (Gauss and Newton).

        Where each position has a phase and a scale of its own, it is an approximation, since the measured responses
        take the scale of the traced ones, which depends on the unknowns.

        Args:
            alike: Cholesky factor of the correlation of what the twin leaves.
            rest: what it leaves.
            jacobian: derivatives of the responses by the unknowns.
            traced: the responses; their common gain is one more unknown, of which nothing is known.
            values: by how much the unknowns have been changed.
            prior: their standard deviations beforehand.
            counted: number of responses that count as independent.
        """
        columns = np.concatenate([jacobian * prior, traced[..., None], 1j * traced[..., None]], axis=-1)
        together = np.concatenate([rest[..., None], columns], axis=-1).reshape(len(rest), -1)
        solved = cho_solve(alike, together).reshape(*rest.shape, -1)
        variance = (rest.conj() * solved[..., 0]).real.sum() / counted / 2  # of the real part, and of the imaginary one
        normal = np.einsum("kmi,kmj->ij", columns.conj(), solved[..., 1:]).real / variance
        towards = np.einsum("kmi,km->i", columns.conj(), solved[..., 0]).real / variance
        number = len(prior)
        # The gain's most likely value for each step leaves Schur's complement.
        by_gain = np.linalg.solve(normal[number:, number:], normal[number:]).T
        free, gain = normal[:number, :number], by_gain[:number]
        precision = free - gain @ normal[number:, :number] + np.eye(number)
        return cls(precision, towards[:number] - gain @ towards[number:] - values / prior, prior)

    @property
    def deviations(self) -> Float[np.ndarray, " n"]:
        """Posterior standard deviations of the unknowns."""
        return self.prior * np.sqrt(np.diag(np.linalg.inv(self.precision)))

    def step(self, reach: float) -> Float[np.ndarray, " n"]:
        """The step to the least value that a step no longer than ``reach`` leads to (Levenberg and Marquardt).

        It is δ = (A + μ)⁻¹ b, with the least damping μ ≥ 0 for which its length is at most ``reach``.

        Args:
            reach: in standard deviations of the priors.

        Returns:
            δ in the unknowns' units.
        """
        sizes, axes = np.linalg.eigh(self.precision)
        along = axes.T @ self.towards

        def longer(damping: float) -> float:
            return float(np.linalg.norm(along / (sizes + damping))) - reach

        damping = brentq(longer, 0, np.linalg.norm(along) / reach) if longer(0) > 0 else 0.0
        return self.prior * (axes @ (along / (sizes + damping)))

    def next_reach(self, step: Float[np.ndarray, " n"], reach: float, gained: float) -> float:
        """How long the next step may be: longer where the responses are as linear as this takes them to be.

        Args:
            step: from the values that this is about.
            reach: how long it was allowed to be.
            gained: by how much it has lowered −2 log of the posterior.
        """
        scaled = step / self.prior
        length = float(np.linalg.norm(scaled))
        expected = float(2 * self.towards @ scaled - scaled @ self.precision @ scaled)
        if gained < POOR * expected:
            return length / 2
        return max(reach, 2 * length) if gained > GOOD * expected else reach
