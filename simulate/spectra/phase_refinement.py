"""Least squares for the responses behind spectra, from good starts, by the Gauss–Newton method.

The unknowns are the responses y and the offset b. The residual in a direction is |B y| − p − b with the beams B y, and
its derivative along δ is Re(e^{−j arg B y} B δ). Conjugate gradients need no more than products with B.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from jaxtyping import Complex, Float

STEPS, INNER_STEPS = 20, 30  # Largest number of steps, and steps of conjugate gradients for each

LEAST_GAIN = 0.02  # Share of its squared error that a step must save, or it is the spectrum's last

DAMPING = 1e-3  # Damping of the first step, as a share of the mean of the normal equations' diagonal


def refined(
    start: Complex[np.ndarray, "K elements"],
    magnitude: Float[np.ndarray, "K P"],
    steering: Complex[np.ndarray, "P elements"],
) -> tuple[Complex[np.ndarray, "K elements"], Float[np.ndarray, " K"]]:
    """Responses and offsets of least squared error in some directions; a step that raises one is undone."""
    elements = start.shape[1]
    unknowns = np.concatenate([start.real, start.imag, np.zeros((len(start), 1))], axis=1)
    damping = np.full(len(start), DAMPING * len(steering) / elements)
    going = np.arange(len(start))

    def residuals(unknowns: Float[np.ndarray, "n u"]) -> tuple[Float[np.ndarray, "n P"], Complex[np.ndarray, "n P"]]:
        """The residuals, and e^{j arg B y}."""
        beams = _beams(unknowns, steering)
        size = np.abs(beams)
        return size - magnitude[going] - unknowns[:, -1:], beams / np.maximum(size, 1e-12)

    here = residuals(unknowns)
    for _ in range(STEPS):
        moved = unknowns[going] + _step(*here, steering, damping[going])
        there = residuals(moved)
        before, after = ((each[0] ** 2).sum(axis=1) for each in (here, there))
        lower = after < before
        unknowns[going[lower]] = moved[lower]
        damping[going] *= np.where(lower, 0.2, 4)
        gains = ~lower | (after < (1 - LEAST_GAIN) * before)
        error, phase = (np.where(lower[:, None], *each)[gains] for each in zip(there, here, strict=True))
        going, here = going[gains], (error, phase)
        if not len(going):
            break
    return unknowns[:, :elements] + 1j * unknowns[:, elements:-1], unknowns[:, -1]


def _beams(unknowns: Float[np.ndarray, "K u"], steering: Complex[np.ndarray, "P elements"]) -> np.ndarray:
    """Beams [K, P] of the responses among the unknowns."""
    real, imaginary = np.split(unknowns[:, :-1], 2, axis=1)
    return (real + 1j * imaginary) @ steering.T


def _step(
    error: Float[np.ndarray, "K P"],
    phase: Complex[np.ndarray, "K P"],
    steering: Complex[np.ndarray, "P elements"],
    damping: Float[np.ndarray, " K"],
) -> Float[np.ndarray, "K u"]:
    """The damped Gauss–Newton step, roughly."""

    def along(change: Float[np.ndarray, "K u"]) -> Float[np.ndarray, "K P"]:
        """The Jacobian times a change of the unknowns."""
        return (phase.conj() * _beams(change, steering)).real - change[:, -1:]

    def transposed(residuals: Float[np.ndarray, "K P"]) -> Float[np.ndarray, "K u"]:
        """The Jacobian's transpose times some residuals."""
        back = (phase * residuals) @ steering.conj()
        return np.concatenate([back.real, back.imag, -residuals.sum(axis=1, keepdims=True)], axis=1)

    return _conjugate_gradients(lambda each: transposed(along(each)) + damping[:, None] * each, transposed(-error))


def _conjugate_gradients(
    matrix: Callable[[Float[np.ndarray, "K n"]], Float[np.ndarray, "K n"]], right: Float[np.ndarray, "K n"]
) -> Float[np.ndarray, "K n"]:
    """Solve K symmetric positive systems roughly, by ``INNER_STEPS`` steps from zero."""
    solution, left, direction = np.zeros_like(right), right, right
    power = (left**2).sum(axis=1)
    for _ in range(INNER_STEPS):
        image = matrix(direction)
        step = (power / np.maximum((direction * image).sum(axis=1), 1e-300))[:, None]
        solution, left = solution + step * direction, left - step * image
        new_power = (left**2).sum(axis=1)
        direction = left + (new_power / np.maximum(power, 1e-300))[:, None] * direction
        power = new_power
    return solution
