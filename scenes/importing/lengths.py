"""Units of length, and how messages show lengths and boxes."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from jaxtyping import Float

METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}
"""Units of length, in metres."""


def plain(length: float) -> str:
    """Format a length for a message: three digits, without an exponent, at most to a micrometre.

    >>> plain(412.3), plain(3.776), plain(1e-16), plain(0.00012), plain(5334569.0), plain(-0.25)
    ('412', '3.78', '0', '0.00012', '5334569', '-0.25')
    """
    decimals = 6 if abs(length) < 1e-4 else max(0, 2 - math.floor(math.log10(abs(length))))
    text = f"{length:.{min(decimals, 6)}f}"
    text = text.rstrip("0").rstrip(".") if "." in text else text
    return "0" if text == "-0" else text


def plain_size(extents: Iterable[float]) -> str:
    """Format the size of a box in metres.

    >>> plain_size([5000, 4, 0.25])
    '5000 x 4 x 0.25 m'
    """
    return " x ".join(plain(extent) for extent in extents) + " m"


def plain_point(point: Iterable[float]) -> str:
    """Format a position in metres.

    >>> plain_point(np.array([0.5, -0.0, 12.3456]))
    '(0.5, 0, 12.3)'
    """
    return f"({', '.join(plain(coordinate) for coordinate in point)})"


def in_each_unit(extents: Float[np.ndarray, " 3"], unit: str) -> dict[str, str]:
    """Return the size that a box would have in each unit.

    >>> in_each_unit(np.array([5, 4, 3]), "m")["mm"]
    '0.005 x 0.004 x 0.003 m'
    """
    return {other: plain_size(extents * metres / METRES[unit]) for other, metres in METRES.items()}
