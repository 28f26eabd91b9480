"""The test of whether a field that oscillates at one frequency has settled."""

from __future__ import annotations

import numpy as np
from jaxtyping import Complex

SETTLED = 1e-3
"""A field has settled if the estimated change still to come is below this share of it, 60 dB down."""

LOOKS = 20
"""Number of parts of a run. The field is examined at the end of each part."""

SLOWEST = 0.95
"""Largest ratio of two changes that is trusted. With a larger one the rest would be estimated from noise."""


def looks(steps: int) -> list[int]:
    """Numbers of time steps after which the field is examined, in a run with a largest number of steps."""
    return [steps * look // LOOKS for look in range(1, LOOKS + 1)]


def still_to_come(
    before_last: Complex[np.ndarray, "..."], last: Complex[np.ndarray, "..."], now: Complex[np.ndarray, "..."]
) -> float:
    """Estimated change of a field that is still to come, relative to the field.

    The phasors at three equally spaced moments change by d₁ and then by d₂. If the changes continue to shrink by the
    ratio q = d₂/d₁, the change still to come is d₂ q/(1 − q).

    Example:
        >>> field = np.array([1.0 + 0j, 1j])
        >>> round(still_to_come(0.98 * field, 0.99 * field, 0.995 * field), 4)
        0.005
    """
    size = float(np.linalg.norm(now))
    if size == 0:
        return float("inf")
    change_before, change = float(np.linalg.norm(last - before_last)), float(np.linalg.norm(now - last))
    ratio = min(change / max(change_before, 1e-300), SLOWEST)
    return change / size * ratio / (1 - ratio)
