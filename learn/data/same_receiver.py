"""Whether two things belong to one receiver: a scene and a dataset, or a run and the pictures to be located."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from scenes.files.errors import InputError
from scenes.scene.description import SPEED_OF_LIGHT
from simulate.spectra.array import Array, PlanarArray

SAME_FREQUENCY, SAME_SPACING = 0.05, 0.05
"""Largest relative difference of wavelengths, and largest difference of element spacings in wavelengths, of one
receiver. Many folders do not state their frequency, and 920 MHz is then taken for 915 MHz."""

SAME_PLACE, SAME_DIRECTION = 1 / 8, 5.0
"""Largest distance of two positions, wavelengths, and largest angle between two orientations, degrees, of one gateway
that was surveyed twice."""

Pose = tuple[Sequence[float] | Float[np.ndarray, " 3"], Sequence[float] | Float[np.ndarray, " 4"]]
"""Position, metres, and unit quaternion (x, y, z, w) of a gateway, world frame."""


def other_frequency(wavelength: float, found: float) -> bool:
    """Whether two wavelengths (metres) are of different receivers."""
    return abs(found / wavelength - 1) > SAME_FREQUENCY


def require_same_frequency(where: Path | str, other: Path | str, wavelength: float, found: float) -> None:
    """Refuse what is found somewhere at another frequency than the other that it belongs to (wavelengths in metres)."""
    if other_frequency(wavelength, found):
        expected = f"{in_megahertz(wavelength)} as in {other}"
        raise InputError(f"{where}: expected {expected}, found {in_megahertz(found)}")


def other_array(array: Array, found: Array, tolerance: float = SAME_SPACING) -> bool:
    """Whether two arrays are of different receivers."""
    if not (isinstance(array, PlanarArray) and isinstance(found, PlanarArray)):
        if array.elements != found.elements:
            return True
        places, other = (each.positions - each.positions.mean(axis=0) for each in (array, found))
        return bool(np.linalg.norm(places - other, axis=1).max() > tolerance)
    shapes = (array.rows, array.columns), (found.rows, found.columns)
    return shapes[0] != shapes[1] or abs(array.spacing - found.spacing) > tolerance


def pose_difference(pose: Pose, found: Pose) -> tuple[float, float]:
    """Distance (metres) and angle (degrees) between two poses of a gateway."""
    turn = Rotation.from_quat(np.asarray(pose[1])).inv() * Rotation.from_quat(np.asarray(found[1]))
    distance = np.linalg.norm(np.subtract(pose[0], found[0]))
    return float(distance), round(float(np.degrees(turn.magnitude())), 6)


def in_megahertz(wavelength: float) -> str:
    """The frequency of a wavelength (metres), for a sentence."""
    return f"{SPEED_OF_LIGHT / wavelength / 1e6:.4g} MHz"
