"""The candidates of a search, and their refinement: Levenberg–Marquardt steps to the best predicted fingerprints."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

MODES = 4  # Largest number of positions that are considered for a transmitter


def grid_in(region: Float[np.ndarray, "2 3"], spacing: float, most: int) -> Float[np.ndarray, "n 3"]:
    """Points of a grid that includes the corners of a box."""
    counts = np.maximum(2, np.ceil((region[1] - region[0]) / spacing - 1e-9) + 1)
    while counts.prod() > 1.5 * most and counts.max() > 2:
        counts = np.maximum(2, np.floor(counts * 0.9))
    axes = [np.linspace(low, high, int(count)) for low, high, count in zip(*region, counts, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def candidate_points(
    points: Float[np.ndarray, "n 3"], likely: Float[np.ndarray, " n"], apart: float
) -> Float[np.ndarray, "MODES 3"]:
    """The most likely point, then the next ones that are far enough from all before. The last one may repeat."""
    left, starts = likely.copy(), list[np.ndarray]()
    for _ in range(MODES):
        best = int(left.argmax())
        starts.append(points[best] if left[best] > -np.inf else starts[-1])
        left[np.linalg.norm(points - points[best], axis=1) < apart] = -np.inf
    return np.stack(starts)


STEPS = 12
STEP = 0.01
"""Step of the finite differences, wavelengths. Finite differences work for every model, ray tracing included."""

LONGEST, FARTHEST = 0.125, 0.25
"""Largest distance that a position moves in one step, and in all, wavelengths. Fingerprints change completely within a
quarter of a wavelength."""


class Refined(NamedTuple):
    """K positions, and how well the field predicts the measured fingerprints there."""

    positions: Float[np.ndarray, "K 3"]  # metres, world frame
    misfit: Float[np.ndarray, " K"]  # squared distance of the fingerprints
    normal: Float[np.ndarray, "K 3 3"]  # JᵀJ of the predicted fingerprints' derivatives J, 1/m²


def refine(
    predicted: Callable[[Float[np.ndarray, "n 3"]], Float[np.ndarray, "n F"]],
    seen: Float[np.ndarray, "K F"],
    start: Float[np.ndarray, "K 3"],
    region: Float[np.ndarray, "2 3"],
    wavelength: float,
) -> Refined:
    """Positions near their starts and in the region at which the squared distance of the fingerprints is smallest."""
    positions, found = start.astype(float), predicted(start)
    misfit = ((found - seen) ** 2).sum(axis=1)
    damping = np.full(len(start), 1e-2)
    for _ in range(STEPS):
        derivative = _derivative(predicted, positions, STEP * wavelength) * (region[1] > region[0])
        normal = derivative.transpose(0, 2, 1) @ derivative
        towards = np.einsum("kfi,kf->ki", derivative, found - seen)
        diagonal = np.einsum("kii->ki", normal)
        damped = normal + np.eye(3) * (damping[:, None] * diagonal + 1e-9)[:, None]
        step = -np.linalg.solve(damped, towards[..., None])[..., 0]
        away = positions + _at_most(step, LONGEST * wavelength) - start
        moved = np.clip(start + _at_most(away, FARTHEST * wavelength), *region)
        there = predicted(moved)
        after = ((there - seen) ** 2).sum(axis=1)
        better = after < misfit
        positions[better], found[better], misfit[better] = moved[better], there[better], after[better]
        damping = np.where(better, damping / 4, damping * 6)
    return Refined(positions, misfit, _normal(predicted, positions, wavelength))


def _normal(
    predicted: Callable[[Float[np.ndarray, "n 3"]], Float[np.ndarray, "n F"]],
    positions: Float[np.ndarray, "K 3"],
    wavelength: float,
) -> Float[np.ndarray, "K 3 3"]:
    """JᵀJ with the step that shows more of the change around each position, 1/m².

    A field that interpolates by inverse distances is flat at each known position, and steep around it. The short step
    alone would see no change there.
    """
    both = [_derivative(predicted, positions, step * wavelength) for step in (STEP, LONGEST)]
    short, long = (each.transpose(0, 2, 1) @ each for each in both)
    steeper = np.trace(short, axis1=1, axis2=2) >= np.trace(long, axis1=1, axis2=2)
    return np.where(steeper[:, None, None], short, long)


def _at_most(step: Float[np.ndarray, "K 3"], longest: float) -> Float[np.ndarray, "K 3"]:
    length = np.linalg.norm(step, axis=1, keepdims=True)
    return step * np.minimum(1, longest / np.maximum(length, 1e-12))


def _derivative(
    predicted: Callable[[Float[np.ndarray, "n 3"]], Float[np.ndarray, "n F"]],
    positions: Float[np.ndarray, "K 3"],
    step: float,
) -> Float[np.ndarray, "K F 3"]:
    """Derivatives of the predicted fingerprints with respect to the position, by central differences, 1/m."""
    beside = positions[:, None, None] + step * np.stack([np.eye(3), -np.eye(3)])
    found = predicted(beside.reshape(-1, 3)).reshape(len(positions), 2, 3, -1).astype(float)
    return ((found[:, 0] - found[:, 1]) / (2 * step)).transpose(0, 2, 1)
