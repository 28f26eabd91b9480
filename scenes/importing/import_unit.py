"""Whether the unit of an imported file is plausible: the place should be about as large as what happens in it.

The gateway and the transmitter region are given in metres, whatever the file's unit is. A room in millimetres that is
read as metres is a thousand times as large as they are, and one in metres that is read as millimetres a thousandth.
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
"""Size of the place over that of the box around the gateway and the transmitter region, within which nothing is said.
Below it the antennas are far outside of the place; above it they are in one corner of it. A street of 1 km with a
transmitter region of 30 m and a gateway nearby is within it, a room in inches or centimetres read as metres is not."""

REFUSED = (1 / 30, 400.0)
"""The same, beyond which the unit must be wrong, as millimetres for metres always are."""

TYPICAL = 2.0
"""The same for rooms: the unit that comes nearest to it is suggested."""


class UnitDoubt(NamedTuple):
    """Why a unit may be wrong.

    Attributes:
        sentence: what was expected, what was found, and which unit would fit.
        impossible: whether the unit must be wrong.
    """

    sentence: str
    impossible: bool


def unit_doubt(
    bounds: Float[np.ndarray, "2 3"], antennas: Float[np.ndarray, "n 3"], unit: str, wavelength: float
) -> UnitDoubt | None:
    """Why the unit that a file was read in may be wrong; None: it is plausible.

    Args:
        bounds: lowest and highest corner of all objects, metres, as the unit makes them.
        antennas: the gateway's position and the corners of the transmitter region, metres.
        unit: the unit.
        wavelength: metres; a place that is smaller reflects nothing.

    >>> unit_doubt(np.array([[0, 0, 0], [5000, 4000, 3000]]), np.array([[0.5, 2, 2], [4, 3, 1]]), "m", 0.33).sentence
    'expected a place about the gateway and the transmitter region, which are within 3.8 m of each other, found one of \
5000 x 4000 x 3000 m by the unit m; by the unit mm it would be 5 x 4 x 3 m'
    >>> unit_doubt(np.array([[0, 0, 0], [5, 4, 3]]), np.array([[0.5, 2, 2], [4, 3, 1]]), "m", 0.33) is None
    True
    """
    if not np.abs(antennas).max() <= FARTHEST:
        return None  # other checks refuse that, and what follows
    extents = bounds[1] - bounds[0]
    size, span = float(np.linalg.norm(extents)), float(np.linalg.norm(np.ptp(antennas, axis=0)))
    if not (size > 0 and span > 0):
        return None
    ratio = size / span
    too_small = size < wavelength
    if not too_small and DOUBTED[0] <= ratio <= DOUBTED[1]:
        return None
    found = f"found one of {_shown(extents)} by the unit {unit}"
    if too_small and DOUBTED[0] <= ratio <= DOUBTED[1]:
        expected = f"expected a place larger than the wavelength, {wavelength:.2g} m"
    else:
        near = f"{span:.2g} m of each other"
        expected = f"expected a place about the gateway and the transmitter region, which are within {near}"
    fits = min(METRES, key=lambda other: abs(math.log(ratio * METRES[other] / METRES[unit] / TYPICAL)))
    suggestion = "; are the gateway and the region right?"
    if fits != unit:
        suggestion = f"; by the unit {fits} it would be {_shown(extents * METRES[fits] / METRES[unit])}"
    return UnitDoubt(f"{expected}, {found}{suggestion}", too_small or not REFUSED[0] <= ratio <= REFUSED[1])


def _shown(extents: Float[np.ndarray, " 3"]) -> str:
    return " x ".join(f"{extent:.3g}" if extent < 100 else f"{extent:.0f}" for extent in extents) + " m"
