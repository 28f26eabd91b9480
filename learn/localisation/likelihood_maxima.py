"""Maxima of the likelihood of a tag's place, by Newton's steps."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float

from learn.localisation.direct_path import DirectPath

STEPS, STEP = 12, 0.01
"""Newton's steps, and the first distance of the points that show the derivatives, wavelengths."""


class Maxima(NamedTuple):
    """Maxima of the likelihood: positions, covariances, and the logarithm of the probability in each maximum."""

    positions: Float[np.ndarray, "M 3"]
    covariances: Float[np.ndarray, "M 3 3"]
    evidence: Float[np.ndarray, " M"]

    def apart(self, least: float) -> Maxima:
        """The maxima at least so far apart, in metres, the most probable one first."""
        kept: list[int] = []
        for each in np.argsort(-self.evidence):
            if all(np.linalg.norm(self.positions[each] - self.positions[other]) > least for other in kept):
                kept.append(int(each))
        return Maxima(*(each[kept] for each in self))


def maximise(
    model: DirectPath, rows: Complex[np.ndarray, "M N"], starts: Float[np.ndarray, "M 3"], box: Float[np.ndarray, "2 3"]
) -> Maxima:
    """Newton's steps from the starts, and the covariances from the curvature at their ends."""
    free = np.flatnonzero(box[1] > box[0])
    positions, value = starts.copy(), model.log_likelihood_at(starts, rows)
    step = np.full((len(starts), len(free)), STEP * model.wavelength)
    damping = np.ones(len(starts))
    for _ in range(STEPS):
        slope, curvature = _derivatives(model, rows, positions, free, step)
        shares, axes = _eigen(curvature, model.wavelength)
        ahead = np.einsum("mij,mj->mi", axes, np.einsum("mij,mi->mj", axes, slope) / (shares * damping[:, None]))
        length = np.linalg.norm(ahead, axis=1, keepdims=True)
        ahead *= np.minimum(1, model.wavelength / 8 / np.maximum(length, 1e-12))
        moved = positions.copy()
        moved[:, free] += ahead
        away = moved - starts
        away *= np.minimum(1, model.wavelength / np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-12) / 2)
        moved = np.clip(starts + away, *box)
        after = model.log_likelihood_at(moved, rows)
        better = after > value
        positions[better], value[better] = moved[better], after[better]
        damping = np.where(better, np.maximum(damping / 4, 1), damping * 4)
        deviation = 1 / np.sqrt(np.maximum(np.einsum("mii->mi", curvature), 1e-12))
        step = np.clip(deviation / 4, 1e-5 * model.wavelength, STEP * model.wavelength)
    shares, axes = _eigen(_derivatives(model, rows, positions, free, step)[1], model.wavelength)
    covariances = np.zeros((len(starts), 3, 3))
    covariances[:, free[:, None], free] = (axes / shares[:, None]) @ axes.transpose(0, 2, 1)
    return Maxima(positions, covariances, value - np.log(shares).sum(axis=1) / 2)


def _derivatives(
    model: DirectPath,
    rows: Complex[np.ndarray, "M N"],
    positions: Float[np.ndarray, "M 3"],
    free: np.ndarray,
    step: Float[np.ndarray, "M F"],
) -> tuple[Float[np.ndarray, "M F"], Float[np.ndarray, "M F F"]]:
    """Gradient of the log-likelihood, and minus its second derivatives, by central differences."""
    count = len(free)
    axes = np.eye(count)
    signs = np.array([np.zeros(count), *axes, *-axes, *(a + b for i, a in enumerate(axes) for b in axes[i + 1 :])])
    points = np.repeat(positions[:, None], len(signs), axis=1)
    points[..., free] += signs * step[:, None]
    values = model.log_likelihood_at(points.reshape(-1, 3), np.repeat(rows, len(signs), axis=0))
    values = values.reshape(len(rows), len(signs))
    middle, ahead, behind = values[:, :1], values[:, 1 : count + 1], values[:, count + 1 : 2 * count + 1]
    curvature = np.empty((len(rows), count, count))
    curvature[:, range(count), range(count)] = (2 * middle - ahead - behind) / step**2
    pairs = [(i, j) for i in range(count) for j in range(i + 1, count)]
    for both, (i, j) in zip(values[:, 2 * count + 1 :].T, pairs, strict=True):
        # f(a + b) − f(a) − f(b) + f(0) has the mixed derivative, and third ones that one more point would remove.
        mixed = (both - ahead[:, i] - ahead[:, j] + middle[:, 0]) / (step[:, i] * step[:, j])
        curvature[:, i, j] = curvature[:, j, i] = -mixed
    return (ahead - behind) / (2 * step), curvature


def _eigen(
    curvature: Float[np.ndarray, "M F F"], wavelength: float
) -> tuple[Float[np.ndarray, "M F"], Float[np.ndarray, "M F F"]]:
    """Eigenvalues of the curvature, and its axes.

    No deviation is larger than a wavelength, over which phases repeat.
    """
    shares, axes = np.linalg.eigh(curvature)
    return np.maximum(np.abs(shares), 1 / wavelength**2), axes
