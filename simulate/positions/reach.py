"""Which positions are far outside a box: that of a scene, or of the positions that a model was trained on."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

FAR = 0.1
"""Distance from the box, as a fraction of the box's diagonal, from which a warning is given."""


def reach_warning(
    positions: Float[np.ndarray, "K 3"], box: Float[np.ndarray, "2 3"], of: str, consequence: str
) -> str | None:
    """A sentence about positions far outside a box; None: there are none.

    Args:
        positions: metres, world frame.
        box: its lowest and highest corner, metres, world frame.
        of: what the box is around.
        consequence: the end of the sentence.

    >>> points = np.array([[1.0, 1, 1], [2, 2, 2.3], [9, 2, 1]])
    >>> reach_warning(points, np.array([[0.0, 0, 0], [2, 2, 2]]), "the scene", "are they in metres?")
    '1 of 3 positions is far outside the box around the scene, x 0 to 2, y 0 to 2 and z 0 to 2 m (the farthest, number \
3, by 7 m); are they in metres?'
    """
    low, high = box
    outside = np.linalg.norm(np.maximum(low - positions, 0) + np.maximum(positions - high, 0), axis=1)
    far = outside > FAR * np.linalg.norm(high - low)
    if not far.any():
        return None
    sides = [f"{axis} {a:.3g} to {b:.3g}" for axis, a, b in zip("xyz", low, high, strict=True)]
    return (
        f"{far.sum()} of {len(far)} positions {'is' if far.sum() == 1 else 'are'} far outside the box around {of}, "
        f"{sides[0]}, {sides[1]} and {sides[2]} m (the farthest, number {outside.argmax() + 1}, by "
        f"{outside.max():.2g} m); {consequence}"
    )
