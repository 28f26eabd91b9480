"""What speaks against the positions of a recording: another unit, or a row for each read."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from scenes.files.errors import InputError

BELIEVED = 50.0
"""Metres. Transmitters that are farther from the array (median) are taken for a mistake, unless the unit is stated."""

WAVELENGTHS = 0.1
"""Positions that spread over less are taken for a mistake of the unit."""


def position_doubts(
    positions: Float[np.ndarray, "K 3"], gateway: tuple[float, float, float], wavelength: float, unit_stated: bool
) -> list[str]:
    """A warning for each oddity of the positions.

    >>> places = np.array([[120.0, 0, 0], [180, 10, 0], [150, 30, 0]])
    >>> position_doubts(places, (0, 0, 0), 0.1, unit_stated=True)
    []
    >>> print(position_doubts(places, (0, 0, 0), 0.1, unit_stated=False)[0])
    warning: the positions are 153 m from the array (median): are they in metres? State --unit
    """
    found = []
    if len(positions) > 1 and not np.ptp(positions, axis=0).any():
        raise InputError(
            f"expected positions that differ, found {positions[0].tolist()} in all {len(positions)} rows: a row holds "
            "one position and the responses of all elements there, not a single read"
        )
    away = float(np.median(np.linalg.norm(positions - np.asarray(gateway), axis=1)))
    spread = float(np.ptp(positions, axis=0).max())
    if away > BELIEVED and not unit_stated:
        found.append(
            f"warning: the positions are {away:.3g} m from the array (median): are they in metres? State --unit"
        )
    if 0 < spread < WAVELENGTHS * wavelength:
        found.append(
            f"warning: the positions spread over {1e3 * spread:.3g} mm only, at a wavelength of {1e3 * wavelength:.3g} "
            "mm: is their unit right?"
        )
    return found
