"""Check whether the unit of an imported file is plausible.

The gateway and the transmitter region are in metres, whatever the file's unit. The scene should be about as large as
the space between them. A room in millimetres that is read as metres is a thousand times too large.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from scenes.scene.description import FARTHEST

DOUBTED = (1 / 3, 60.0)
"""Smallest and largest plausible ratio: the size of the scene over that of the box around the gateway and the
transmitter region. Below it, the antennas are far outside the scene; above it, they are in one corner. A street of 1 km
with a transmitter region of 30 m and a gateway nearby is plausible. A room in inches or centimetres that is read as
metres is not."""

REFUSED = (1 / 30, 400.0)
"""Smallest and largest possible ratio. Beyond it, the unit must be wrong. Millimetres for metres are always beyond."""

TYPICAL = 2.0
"""Typical ratio of a room. The unit whose ratio is nearest to it is suggested."""

METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}
"""Units of length, in metres."""


class UnitDoubt(NamedTuple):
    """A reason to doubt a unit."""

    sentence: str  # what was expected, what was found, which unit would fit, and the size in each unit
    impossible: bool  # whether the unit cannot be right


def unit_doubt(
    bounds: Float[np.ndarray, "2 3"], antennas: Float[np.ndarray, "n 3"], unit: str, wavelength: float
) -> UnitDoubt | None:
    """Return the reason to doubt the unit of a file; None if the unit is plausible.

    >>> unit_doubt(np.array([[0, 0, 0], [5000, 4000, 3000]]), np.array([[0.5, 2, 2], [4, 3, 1]]), "m", 0.33).sentence
    'expected a scene about as large as the gateway and the transmitter region together, 3.77 m, found one of \
5000 x 4000 x 3000 m with the unit m; with the unit mm it would be 5 x 4 x 3 m (in the others: cm 50 x 40 x 30 m, in \
127 x 102 x 76.2 m, ft 1524 x 1219 x 914 m)'
    >>> unit_doubt(np.array([[0, 0, 0], [5, 4, 3]]), np.array([[0.5, 2, 2], [4, 3, 1]]), "m", 0.33) is None
    True
    """
    if not np.abs(antennas).max() <= FARTHEST:
        return None  # other checks refuse this case and the next one
    extents = bounds[1] - bounds[0]
    size, span = float(np.linalg.norm(extents)), float(np.linalg.norm(np.ptp(antennas, axis=0)))
    if not (size > 0 and span > 0):
        return None
    ratio = size / span
    too_small = size < wavelength
    if not too_small and DOUBTED[0] <= ratio <= DOUBTED[1]:
        return None
    found = f"found one of {plain_size(extents)} with the unit {unit}"
    if too_small and DOUBTED[0] <= ratio <= DOUBTED[1]:
        expected = f"expected a scene larger than the wavelength, {plain(wavelength)} m"
    else:
        expected = (
            f"expected a scene about as large as the gateway and the transmitter region together, {plain(span)} m"
        )
    sizes = in_each_unit(extents, unit)
    fits = min(METRES, key=lambda other: abs(math.log(ratio * METRES[other] / METRES[unit] / TYPICAL)))
    suggestion = "are the gateway and the region right?"
    if fits != unit:
        suggestion = f"with the unit {fits} it would be {sizes[fits]}"
    others = ", ".join(f"{other} {size}" for other, size in sizes.items() if other not in (unit, fits))
    return UnitDoubt(
        f"{expected}, {found}; {suggestion} (in the others: {others})",
        too_small or not REFUSED[0] <= ratio <= REFUSED[1],
    )


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
