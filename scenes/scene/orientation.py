"""Orientations as quaternions (x, y, z, w), and the directions that arrays with these orientations look in."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from scenes.files.errors import InputError, check_array, shown

Vector3 = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

GATEWAY_FROM_TRANSMITTER = Rotation.from_matrix([[0, 1, 0], [0, 0, 1], [1, 0, 0]])
"""Rotation from the transmitter's frame, which is that of Sionna RT's devices, to the gateway's. The polarisation "V"
is along z in the former and along y in the latter."""

UNIT_TOLERANCE = 1e-3
"""Largest deviation of a quaternion's length from 1. Published quaternions often have only a few digits."""


def unit_quaternion(orientation: Sequence[float]) -> Quaternion:
    """Scale a quaternion to length 1 if its length is nearly 1. Others are left for ``validate`` to refuse."""
    orientation = check_array("orientation", orientation, (4,), "a quaternion x, y, z, w", finite=False).tolist()
    norm = math.sqrt(sum(component * component for component in orientation))
    # A length that is 1 within rounding is left alone, so that a scene read from a file equals the one written.
    if 1e-12 < abs(norm - 1) <= UNIT_TOLERANCE:
        orientation = [component / norm for component in orientation]
    x, y, z, w = (float(component) for component in orientation)
    return x, y, z, w


def facing(boresight: Vector3) -> Quaternion:
    """Return the orientation of a gateway that looks along a boresight.

    The gateway's +z axis points along the boresight. Its +y axis points as far up (towards world +z) as possible. If
    the boresight points straight up or down, the +y axis is world +y.

    Args:
        boresight: direction in the world frame, of any length.

    Returns:
        Unit quaternion (x, y, z, w) that rotates the gateway frame into the world frame.

    Raises:
        InputError: the boresight has length zero or is not finite.

    Example:
        >>> import bisplat
        >>> orientation = bisplat.facing((-1, 0, 0))  # on the east wall, looking west
        >>> [round(component, 3) for component in orientation]
        [0.5, -0.5, -0.5, 0.5]

        ``Gateway.boresight`` is the inverse:

        >>> gateway = bisplat.Gateway(position=(7, 3, 1.5), orientation=orientation)
        >>> (gateway.boresight.round(6) + 0.0).tolist()
        [-1.0, 0.0, 0.0]
    """
    direction = check_array("boresight", boresight, (3,), "a direction x, y, z", finite=False)
    length = float(np.linalg.norm(direction))
    if not (math.isfinite(length) and length > 0):
        raise InputError(f"boresight: expected a direction, found {shown(list(boresight))}")
    z = direction / length
    up = np.array([0.0, 0.0, 1.0]) if abs(z[2]) < 1 - 1e-9 else np.array([0.0, 1.0, 0.0])
    x = np.cross(up, z)
    x /= np.linalg.norm(x)
    q = Rotation.from_matrix(np.stack([x, np.cross(z, x), z], axis=1)).as_quat()
    return float(q[0]), float(q[1]), float(q[2]), float(q[3])


def boresight_of(orientation: Sequence[float] | Float[np.ndarray, " 4"]) -> Float[np.ndarray, " 3"]:
    """Return the boresight of a gateway from its orientation."""
    return Rotation.from_quat(orientation).apply([0, 0, 1])
