"""An even choice of a few of many spectra, in the order of the folder."""

from __future__ import annotations

import numpy as np
from jaxtyping import Shaped


def evenly(values: Shaped[np.ndarray, "n *shape"], most: int) -> Shaped[np.ndarray, "m *shape"]:
    """At most ``most`` of the values, evenly spread over them.

    Args:
        values: indices, or spectra, in any order.
        most: largest number of values to return.

    >>> evenly(np.arange(10), 3).tolist()
    [0, 4, 9]
    """
    return values[np.unique(np.linspace(0, len(values) - 1, min(most, len(values))).astype(int))]
