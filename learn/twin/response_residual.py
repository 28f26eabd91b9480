"""Measured element responses beside traced ones: what is left is taken to be a Gaussian field plus noise.

The field solves the wave equation and is correlated within half a wavelength. A hundred positions within a wavelength
therefore do not count as a hundred measurements.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float, Int
from scipy.linalg import cho_factor, cho_solve

from learn.twin.gains import aligned_to, unexplained, without_own_phase
from simulate.rays.tracer import Tracer
from simulate.spectra.spectrum import evenly

COUNTED = 160
"""Largest number of responses that count as independent: those of ten positions with sixteen elements. An error of the
rays, such as that of a surface that scatters more than they assume, is the same at all positions."""

UNCORRELATED = 0.1
"""Share of the twin's error that is uncorrelated between positions, including the noise."""

LENGTH = 1.0  # Correlation length of the waves that the twin lacks, metres

COMPARED = 20  # Largest number of positions at which guesses are compared

LEAST_MISFIT = 1e-6  # Least value of 1 − s; smaller values are rounding errors


def correlation(positions: Float[np.ndarray, "K 3"], wavelength: float) -> Float[np.ndarray, "K K"]:
    """Correlation of the twin's errors at two positions: sin(kΔ)/kΔ, fading over ``LENGTH``, plus noise."""
    apart = np.linalg.norm(positions[:, None] - positions, axis=-1)
    waves = np.sinc(2 * apart / wavelength) * np.exp(-apart / LENGTH)
    return (1 - UNCORRELATED) * waves + UNCORRELATED * np.eye(len(positions))


class ResponseFit(NamedTuple):
    """Measured responses beside traced ones."""

    unlikely: float  # −2 log of their likelihood, up to a constant; the noise has its most likely variance
    misfit: float  # share of the measured power that the traced responses do not explain
    gain: complex  # common gain of the measured responses over the traced ones; 1 if each has a phase of its own
    rest: Complex[np.ndarray, "K M"]  # what the traced responses leave of the measured ones, in their phase and scale

    def predicted(self, tracers: Collection[Tracer], positions: Float[np.ndarray, "P 3"]) -> Complex[np.ndarray, "P M"]:
        """Responses at other positions, in the gain of the measured ones."""
        return self.gain * next(iter(tracers)).responses(positions)


@dataclass(frozen=True)
class ResponseResidual:
    """The likelihood of measured responses."""

    measured: Complex[np.ndarray, "K M"]  # at several frequencies one after another
    alike: tuple[np.ndarray, bool]  # Cholesky factor of the correlation of errors, as ``cho_factor`` returns it
    phases_known: bool  # whether the responses have a common gain; otherwise each position has a phase and a scale
    flips: bool  # whether any of them may be flipped, as responses behind pictures may be

    @classmethod
    def stages(
        cls,
        measured: Complex[np.ndarray, "K M"],
        positions: Float[np.ndarray, "K 3"],
        wavelength: float,
        phases_known: bool,
        flips: bool,
    ) -> list[ResponseResidual]:
        """What a search compares: responses in a phase of their own and, if phases are known, then in a common one.

        A gateway half a wavelength nearer to a wall, with the opposite common gain, can be a minimum too. Responses
        that are each compared in a phase of their own have no common gain, and lead close to the right minimum.
        """
        alike = cho_factor(correlation(positions, wavelength), lower=True)
        return [cls(measured, alike, common, flips) for common in ((False, True) if phases_known else (False,))]

    @property
    def compared(self) -> Int[np.ndarray, " k"]:
        """Numbers of the positions at which guesses are compared."""
        return evenly(np.arange(len(self.measured)), COMPARED)

    @property
    def counted(self) -> int:
        """Number of responses that count as independent."""
        return min(self.measured.size, COUNTED)

    def fit(self, traced: Complex[np.ndarray, "K M"]) -> ResponseFit:
        aligned, gain = aligned_to(self.measured, traced, self.phases_known, self.flips)
        rest = without_own_phase(aligned - traced, traced, self.phases_known)
        left = (rest.conj() * cho_solve(self.alike, rest)).real.sum() / (np.abs(aligned) ** 2).sum()
        return ResponseFit(2 * self.counted * float(np.log(left)), unexplained(rest, aligned), gain, rest)

    def in_words(self, misfit: float) -> str:
        freely = "" if self.phases_known else " (each spectrum with a separate phase)"
        return f"{misfit:.2%} of the power unexplained{freely}"

    def quadratic(
        self, fit: ResponseFit, traced: Complex[np.ndarray, "K M"], jacobian: Complex[np.ndarray, "K M n"]
    ) -> tuple[Float[np.ndarray, "n n"], Float[np.ndarray, " n"]]:
        """As ``Residual`` has it. With each step, the gain follows; scales of single positions stay."""
        jacobian, rest = without_own_phase(jacobian, traced, self.phases_known), fit.rest
        columns = np.concatenate([jacobian, traced[..., None], 1j * traced[..., None]], axis=-1)
        together = np.concatenate([rest[..., None], columns], axis=-1).reshape(len(rest), -1)
        solved = cho_solve(self.alike, together).reshape(*rest.shape, -1)
        variance = (rest.conj() * solved[..., 0]).real.sum() / self.counted / 2  # of real and of imaginary parts
        normal = np.einsum("kmi,kmj->ij", columns.conj(), solved[..., 1:]).real / variance
        towards = np.einsum("kmi,km->i", columns.conj(), solved[..., 0]).real / variance
        number = jacobian.shape[-1]
        # With the most likely gain for each step, the Schur complement remains.
        by_gain = np.linalg.solve(normal[number:, number:], normal[number:]).T
        free, gain = normal[:number, :number], by_gain[:number]
        return free - gain @ normal[number:, :number], towards[:number] - gain @ towards[number:]

    def of_guesses(self, gateway: int, found: Complex[np.ndarray, "G k M"]) -> Float[np.ndarray, " G"]:
        """As ``Residual`` has it: 2 N log(1 − s), where N responses count as independent.

        s is the mean over the positions of |⟨y, measured⟩|² / (|y|² |measured|²), on which a separate phase and scale
        of each position have no effect.
        """
        measured = self.measured[self.compared]
        alike = np.abs(np.einsum("gkm,km->gk", found, measured.conj()))
        if self.flips:
            alike = np.maximum(alike, np.abs(np.einsum("gkm,km->gk", found, measured[:, ::-1])))
        size = np.linalg.norm(found, axis=-1) * np.linalg.norm(measured, axis=-1)
        score = np.divide(alike, size, out=np.zeros_like(alike), where=size > 0) ** 2
        return 2 * self.counted * np.log(np.maximum(1 - score.mean(axis=1), LEAST_MISFIT))
