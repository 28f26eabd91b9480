"""Which points lie inside a solid object, where neither a gateway nor a transmitter can be."""

from __future__ import annotations

import numpy as np
import trimesh
from jaxtyping import Bool, Float
from trimesh import Trimesh

from scenes.scene.description import Scene

CHUNK = 200_000
"""Point-triangle pairs computed at a time, which bounds the memory of the solid angles."""


def winding_number(points: Float[np.ndarray, "n 3"], triangles: Float[np.ndarray, "t 3 3"]) -> Float[np.ndarray, " n"]:
    """How often a surface wraps around each point: ±1 inside a closed surface, 0 outside.

    Sum of the triangles' signed solid angles over 4π, each by Van Oosterom and Strackee [vanoosterom1983]:

        tan(Ω/2) = a·(b × c) / (|a||b||c| + (a·b)|c| + (b·c)|a| + (c·a)|b|)

    with a, b, c from the point to the corners. Counting the crossings of a ray instead would fail where the ray runs
    along an edge or a face, which is common among boxes.

    Args:
        points: metres.
        triangles: corners of the surface's triangles, metres.

    Returns:
        The winding number of each point.
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


def merge_corners(mesh: Trimesh) -> Trimesh:
    """A copy whose faces share corners; files repeat them per face or per normal, and then no component is closed."""
    copy = Trimesh(mesh.vertices, mesh.faces, process=False)
    copy.merge_vertices()
    return copy


def closed_parts(mesh: Trimesh) -> list[Trimesh]:
    """The connected components of a mesh that bound a volume, wound consistently; sheets and open shells have none."""
    parts = list(merge_corners(mesh).split(only_watertight=True, repair=False))
    for part in parts:
        trimesh.repair.fix_winding(part)  # the solid angles of triangles wound in opposite senses would cancel
    return parts


def _inside(points: Float[np.ndarray, "n 3"], part: Trimesh) -> Bool[np.ndarray, " n"]:
    low, high = part.bounds
    inside = np.all((points > low) & (points < high), axis=1)
    inside[inside] = np.abs(winding_number(points[inside], part.triangles)) > 0.5
    return inside


def holds_antennas(scene: Scene, part: Trimesh) -> bool:
    """Whether a closed surface is that of the room: the gateway and the whole transmitter region are within it.

    Args:
        scene: the scene.
        part: one of ``closed_parts``.
    """
    # The region is shrunk by a thousandth, so that a region that reaches the walls is still inside the room.
    corners = scene.transmitter.corners()
    corners = corners + 1e-3 * (corners.mean(axis=0) - corners)
    return bool(_inside(np.vstack([corners, scene.gateway.position]), part).all())


def blocking_object(scene: Scene, points: Float[np.ndarray, "n 3"]) -> list[str | None]:
    """The object that each point lies inside.

    Only closed components of a mesh have an inside. A closed component that holds the gateway and the whole
    transmitter region is the room, not an obstacle.

    Args:
        scene: the scene.
        points: metres, world frame.

    Returns:
        The object's name for each point, None for points outside every object.
    """
    points = np.asarray(points, dtype=float)
    blocker: list[str | None] = [None] * len(points)
    for item in scene.objects:
        for part in closed_parts(item.mesh):
            if holds_antennas(scene, part):
                continue
            for index in np.flatnonzero(_inside(points, part)):
                blocker[index] = item.name
    return blocker


def inside_object(scene: Scene, points: Float[np.ndarray, "n 3"]) -> Bool[np.ndarray, " n"]:
    """Whether each point (metres, world frame) lies inside an object, by ``blocking_object``."""
    return np.array([name is not None for name in blocking_object(scene, points)], dtype=bool)
