"""Check whether the unit of an imported file is plausible.

The gateway and the transmitter region are in metres, whatever the file's unit. The scene should be about as large as
the space between them. A room in millimetres that is read as metres is a thousand times too large.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from scenes.scene.description import FARTHEST

METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}
"""Units of length, in metres."""

DOUBTED = (1 / 3, 60.0)
"""Smallest and largest plausible ratio: the size of the scene over that of the box around the gateway and the
transmitter region. Below it, the antennas are far outside the scene; above it, they are in one corner. A street of 1 km
with a transmitter region of 30 m and a gateway nearby is plausible. A room in inches or centimetres that is read as
metres is not."""

REFUSED = (1 / 30, 400.0)
"""Smallest and largest possible ratio. Beyond it, the unit must be wrong. Millimetres for metres are always beyond."""

TYPICAL = 2.0
"""Typical ratio of a room. The unit whose ratio is nearest to it is suggested."""


class UnitDoubt(NamedTuple):
    """A reason to doubt a unit.

    Attributes:
        sentence: what was expected, what was found, and which unit would fit.
        impossible: whether the unit cannot be right.
    """

    sentence: str
    impossible: bool


def unit_doubt(
    bounds: Float[np.ndarray, "2 3"], antennas: Float[np.ndarray, "n 3"], unit: str, wavelength: float
) -> UnitDoubt | None:
    """Return the reason to doubt the unit of a file; None if the unit is plausible.

    Args:
        bounds: lowest and highest corner of all objects, metres, if the unit is right.
        antennas: the gateway's position and the corners of the transmitter region, metres.
        unit: the unit.
        wavelength: metres. A scene smaller than the wavelength reflects nothing.

    >>> unit_doubt(np.array([[0, 0, 0], [5000, 4000, 3000]]), np.array([[0.5, 2, 2], [4, 3, 1]]), "m", 0.33).sentence
    'expected a scene about as large as the gateway and the transmitter region together, 3.8 m, found one of \
5000 x 4000 x 3000 m with the unit m; with the unit mm it would be 5 x 4 x 3 m'
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
    found = f"found one of {_shown(extents)} with the unit {unit}"
    if too_small and DOUBTED[0] <= ratio <= DOUBTED[1]:
        expected = f"expected a scene larger than the wavelength, {wavelength:.2g} m"
    else:
        expected = f"expected a scene about as large as the gateway and the transmitter region together, {span:.2g} m"
    fits = min(METRES, key=lambda other: abs(math.log(ratio * METRES[other] / METRES[unit] / TYPICAL)))
    suggestion = "; are the gateway and the region right?"
    if fits != unit:
        suggestion = f"; with the unit {fits} it would be {_shown(extents * METRES[fits] / METRES[unit])}"
    return UnitDoubt(f"{expected}, {found}{suggestion}", too_small or not REFUSED[0] <= ratio <= REFUSED[1])


def _shown(extents: Float[np.ndarray, " 3"]) -> str:
    return " x ".join(f"{extent:.3g}" if extent < 100 else f"{extent:.0f}" for extent in extents) + " m"
