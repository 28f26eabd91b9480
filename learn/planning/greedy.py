"""Greedy choice of positions: each one is that which lowers the kriging variance most."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Inexact, Int


@dataclass(frozen=True)
class OpenField:
    """What is still unknown of a random field at N candidates."""

    # covariance of the field at the candidates, given what is known; real, or complex and Hermitian
    covariance: Inexact[np.ndarray, "N N"]
    nugget: float  # variance of a measurement's noise, in the units of ``covariance``; above 0


def choose(
    fields: Sequence[OpenField], count: int, report: Callable[[int, int], None] = lambda done, total: None
) -> tuple[Int[np.ndarray, " count"], Float[np.ndarray, " count+1"]]:
    """Choose candidates one after another, each the one whose measurement lowers the summed kriging variance most.

    A measurement of candidate j lowers the variance, summed over all candidates, by ``Σ_i |C_ij|² / (C_jj + ν)``, where
    C is the covariance given everything measured before. The sum over the fields decides. C then loses ``c cᴴ
    / (C_jj + ν)``, where c is its column j. The columns c are kept instead of changing C, so that a step costs one
    product of C with a vector.
    """
    size = len(fields[0].covariance)
    squares = [np.square(np.abs(field.covariance)).sum(axis=0) for field in fields]
    variances = [field.covariance.diagonal().real.copy() for field in fields]
    # Row t is conj(c) / √(C_jj + ν) of choice t. These rows are a matrix V; all choices together take Vᴴ V from C.
    rows = [np.zeros((count, size), field.covariance.dtype) for field in fields]
    chosen = np.zeros(count, int)
    left = np.zeros(count + 1)
    left[0] = sum(float(variance.mean()) for variance in variances)
    free = np.ones(size, bool)
    for step in range(count):
        report(step, count)
        gains = np.zeros(size)
        for field, square, variance in zip(fields, squares, variances, strict=True):
            gains += square / (variance + field.nugget)
        chosen[step] = best = int(np.where(free, gains, -np.inf).argmax())
        free[best] = False
        left[step + 1] = left[step] - gains[best] / size
        for field, square, variance, taken in zip(fields, squares, variances, rows, strict=True):
            before = taken[:step]
            column = field.covariance[:, best] - before.conj().T @ before[:, best]
            column /= np.sqrt(variance[best] + field.nugget)
            # |C_ij − c_i c_j*|² summed over i, computed from the sum before this choice.
            products = column.conj() @ field.covariance - (before @ column).conj() @ before
            square -= (2 * products * column).real - np.square(np.abs(column)) * np.vdot(column, column).real
            variance -= np.square(np.abs(column))
            np.maximum(square, 0, out=square)
            np.maximum(variance, 0, out=variance)
            taken[step] = column.conj()
    return chosen, left
