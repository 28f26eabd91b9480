"""Check whether a gateway's array is in the open: no element on a surface, and no surface between elements.

A wall is a sheet without an inside. So ``scenes.checks.occupancy`` does not notice an array that reaches through it.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal, NamedTuple

import numpy as np
from jaxtyping import Bool, Float
from scipy.spatial.transform import Rotation
from trimesh.triangles import closest_point

from scenes.scene.antennas import Gateway
from scenes.scene.description import SceneObject

TOUCHING = 1e-3
"""Metres. Rays from an element that is nearer to a surface may start on either side of it."""


class Obstruction(NamedTuple):
    """An element of an array that is not in the open."""

    element: Float[np.ndarray, " 3"]  # position of the element, metres, world frame
    object: str  # name of the object
    where: Literal["on", "behind"]  # "on" the object's surface, or "behind" it as seen from the gateway's position


def element_positions(gateway: Gateway, wavelength: float) -> Float[np.ndarray, "elements 3"]:
    """Return the positions of a gateway's elements, metres, world frame.

    >>> element_positions(Gateway((1, 0, 2), (0, 0, 0, 1), rows=1, columns=2), wavelength=0.2).tolist()
    [[0.95, 0.0, 2.0], [1.05, 0.0, 2.0]]
    """
    if gateway.elements is not None:
        turned = Rotation.from_quat(gateway.orientation).apply(np.array(gateway.elements))
        return np.asarray(gateway.position) + turned
    row, column = np.divmod(np.arange(gateway.rows * gateway.columns), gateway.columns)
    local = np.stack([column - (gateway.columns - 1) / 2, row - (gateway.rows - 1) / 2, 0 * row], axis=1)
    turned = Rotation.from_quat(gateway.orientation).apply(local)
    return np.asarray(gateway.position) + gateway.spacing * wavelength * turned


def obstruction(gateway: Gateway, wavelength: float, objects: Iterable[SceneObject]) -> Obstruction | None:
    """Find an element on an object's surface, or behind one as seen from the gateway's position.

    >>> from scenes.scene.shapes import sheet
    >>> wall = SceneObject("wall", sheet((0, -2, 0), (0, 4, 0), (0, 0, 3)), "brick")
    >>> obstruction(Gateway((0.1, 0, 1.5), (0, 0, 0, 1)), 0.33, [wall]).where
    'behind'
    """
    centre = np.asarray(gateway.position)
    points = np.vstack([centre, element_positions(gateway, wavelength)])
    low, high = points.min(axis=0) - TOUCHING, points.max(axis=0) + TOUCHING
    for item in objects:
        triangles = np.asarray(item.mesh.triangles)
        near = ((triangles.min(axis=1) <= high) & (triangles.max(axis=1) >= low)).all(axis=1)
        for triangle in triangles[near]:
            nearest = closest_point(np.repeat(triangle[None], len(points), axis=0), points)
            touching = np.linalg.norm(nearest - points, axis=1) <= TOUCHING
            behind = crosses(centre, points, triangle)
            if (touching | behind).any():
                index = int(np.argmax(touching | behind))
                return Obstruction(points[index], item.name, "on" if touching[index] else "behind")
    return None


def crosses(
    starts: Float[np.ndarray, "*n 3"], ends: Float[np.ndarray, "n 3"], triangle: Float[np.ndarray, "3 3"]
) -> Bool[np.ndarray, " n"]:
    """Whether straight lines cross a triangle, by the method of Möller and Trumbore [moller1997]."""
    corner, u, v = triangle[0], triangle[1] - triangle[0], triangle[2] - triangle[0]
    along, from_corner = ends - starts, starts - corner
    p, q = np.cross(along, v), np.cross(from_corner, u)
    determinant = p @ u
    # A line in the plane of the triangle crosses nothing. Elements there are found to touch it.
    scale = np.where(determinant == 0, np.inf, determinant)
    a, b, t = (p * from_corner).sum(axis=-1) / scale, (along * q).sum(axis=-1) / scale, (q @ v) / scale
    return (determinant != 0) & (a >= 0) & (b >= 0) & (a + b <= 1) & (t >= 0) & (t <= 1)
