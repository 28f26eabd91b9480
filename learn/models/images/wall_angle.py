"""The angle of a room's walls about the vertical, which the known spectra tell."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from simulate.dataset.dataset import Dataset

COARSE = 5
"""Step of the angles that are tried first, degrees. Around the best one, whole degrees are tried."""

CLEAR = 0.25
"""Least gain of the log-likelihood of each response over that of walls along the axes. For less, walls are not turned:
most descriptions of rooms have them along the axes, and an angle that is a few degrees off changes little."""


def angle_of_walls(likelihood: Callable[[int], float]) -> int:
    """The angle of perpendicular walls from the x axis, degrees, 0…89.

    >>> angle_of_walls(lambda degrees: -abs(degrees - 31) / 30), angle_of_walls(lambda degrees: -abs(degrees - 3) / 30)
    (31, 0)
    """
    tried = {degrees: likelihood(degrees) for degrees in range(0, 90, COARSE)}
    best = max(tried, key=tried.__getitem__)
    for each in range(best - COARSE + 1, best + COARSE):
        degrees = each % 90
        tried[degrees] = tried[degrees] if degrees in tried else likelihood(degrees)
    best = max(tried, key=tried.__getitem__)
    return best if tried[best] > tried[0] + CLEAR else 0


def frame_of_walls(degrees: int) -> Float[np.ndarray, "3 3"]:
    """The rotation matrix from the world frame to a frame whose axes run along the walls and up.

    >>> (frame_of_walls(90) @ [0, 1, 0]).round(3).tolist()
    [1.0, 0.0, 0.0]
    """
    return Rotation.from_euler("z", -degrees, degrees=True).as_matrix()


def in_frame(dataset: Dataset, frame: Float[np.ndarray, "3 3"]) -> Dataset:
    """A dataset whose world frame is another one."""
    turn = Rotation.from_matrix(frame)
    return replace(
        dataset,
        positions=turn.apply(dataset.positions),
        gateway_position=turn.apply(dataset.gateway_position),
        gateway_orientation=(turn * Rotation.from_quat(dataset.gateway_orientation)).as_quat(),
    )
