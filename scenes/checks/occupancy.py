"""Find points inside solid objects, where neither a gateway nor a transmitter can be."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float
from trimesh import Trimesh

from scenes.scene.description import Scene

CHUNK = 200_000
"""Pairs of a point and a triangle that are computed at a time. This limits the memory."""


def winding_number(points: Float[np.ndarray, "n 3"], triangles: Float[np.ndarray, "t 3 3"]) -> Float[np.ndarray, " n"]:
    """Return how often a surface wraps around each point: ±1 inside a closed surface, 0 outside.

    It is the sum of the signed solid angles Ω of the triangles, divided by 4π. With vectors a, b, c from the point to
    the corners of a triangle [vanoosterom1983]::

        tan(Ω/2) = a·(b × c) / (|a||b||c| + (a·b)|c| + (b·c)|a| + (c·a)|b|)

    The alternative is to count the crossings of a ray. It fails if the ray runs along an edge or a face, which is
    common with boxes.
    """

    def dot(u: np.ndarray, v: np.ndarray) -> np.ndarray:
        return np.einsum("...i,...i->...", u, v)

    total = np.zeros(len(points))
    step = max(1, CHUNK // len(triangles))
    for start in range(0, len(points), step):
        part = slice(start, start + step)
        a, b, c = np.moveaxis(triangles[None] - points[part, None, None], 2, 0)
        la, lb, lc = (np.sqrt(dot(x, x)) for x in (a, b, c))
        numerator = dot(a, np.cross(b, c))
        ab, bc, ca = dot(a, b), dot(b, c), dot(c, a)
        omega = 2 * np.arctan2(numerator, la * lb * lc + ab * lc + bc * la + ca * lb)
        total[part] = omega.sum(axis=1) / (4 * np.pi)
    return total


def _inside(points: Float[np.ndarray, "n 3"], part: Trimesh) -> Bool[np.ndarray, " n"]:
    low, high = part.bounds
    inside = np.all((points > low) & (points < high), axis=1)
    inside[inside] = np.abs(winding_number(points[inside], part.triangles)) > 0.5
    return inside


def holds_antennas(scene: Scene, part: Trimesh) -> bool:
    """Whether a closed part is the room: it contains the gateway and the whole transmitter region."""
    # The region is shrunk by a thousandth. A region that reaches the walls is still inside the room.
    corners = scene.transmitter.corners()
    corners = corners + 1e-3 * (corners.mean(axis=0) - corners)
    antennas = np.vstack([corners, scene.gateway.position])
    low, high = part.bounds
    if not ((antennas > low) & (antennas < high)).all():  # as for furniture and most buildings
        return False
    return bool(_inside(antennas, part).all())


def blocking_object(scene: Scene, points: Float[np.ndarray, "n 3"]) -> list[str | None]:
    """Find the object that contains each point.

    Only closed parts of a mesh have an inside. A closed part that contains the gateway and the whole transmitter region
    is the room, not an obstacle.
    """
    points = np.asarray(points, dtype=float)
    blocker: list[str | None] = [None] * len(points)
    for item in scene.objects:
        for part in item.closed_parts:
            inside = np.flatnonzero(_inside(points, part))
            if not len(inside) or holds_antennas(scene, part):
                continue
            for index in inside:
                blocker[index] = item.name
    return blocker


def inside_object(scene: Scene, points: Float[np.ndarray, "n 3"]) -> Bool[np.ndarray, " n"]:
    """Whether each point (metres, world frame) is inside an object, see ``blocking_object``."""
    return np.array([name is not None for name in blocking_object(scene, points)], dtype=bool)
