"""Which positions are so far from those that a model was trained on that its prediction there is a guess."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

FAR = 0.1
"""Distance from the box of training positions, as a fraction of the box's diagonal, from which a warning is given."""


def reach_warning(positions: Float[np.ndarray, "K 3"], region: Float[np.ndarray, "2 3"]) -> str | None:
    """A sentence about positions far outside the box of training positions; None: there are none.

    Args:
        positions: metres, world frame.
        region: lowest and highest corner of the box of training positions, metres, world frame.

    >>> reach_warning(np.array([[1.0, 1, 1], [2, 2, 2.3], [9, 2, 1]]), np.array([[0.0, 0, 0], [2, 2, 2]]))
    '1 of 3 positions is far outside the box of the training positions, x 0 to 2, y 0 to 2 and z 0 to 2 m (the \
farthest, number 3, by 7 m); predictions there are guesses'
    """
    low, high = region
    outside = np.linalg.norm(np.maximum(low - positions, 0) + np.maximum(positions - high, 0), axis=1)
    far = outside > FAR * np.linalg.norm(high - low)
    if not far.any():
        return None
    box = [f"{axis} {a:.3g} to {b:.3g}" for axis, a, b in zip("xyz", low, high, strict=True)]
    return (
        f"{far.sum()} of {len(far)} positions {'is' if far.sum() == 1 else 'are'} far outside the box of the training "
        f"positions, {box[0]}, {box[1]} and {box[2]} m (the farthest, number {outside.argmax() + 1}, by "
        f"{outside.max():.2g} m); predictions there are guesses"
    )
