"""Units of length, and how messages show lengths and boxes."""

from __future__ import annotations

import math
from collections.abc import Iterable

METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}  # Units of length, in metres


def plain(length: float) -> str:
    """Format a length for a message: three digits, without an exponent, at most to a micrometre."""
    decimals = 6 if abs(length) < 1e-4 else max(0, 2 - math.floor(math.log10(abs(length))))
    text = f"{length:.{min(decimals, 6)}f}"
    text = text.rstrip("0").rstrip(".") if "." in text else text
    return "0" if text == "-0" else text


def plain_size(extents: Iterable[float]) -> str:
    return " x ".join(plain(extent) for extent in extents) + " m"


def rounded(vector: Iterable[float], digits: int = 4) -> list[float]:
    """Round coordinates for a file or a page; none becomes -0.0."""
    return [round(float(value), digits) + 0.0 for value in vector]


def plain_point(point: Iterable[float]) -> str:
    return f"({', '.join(plain(coordinate) for coordinate in point)})"
