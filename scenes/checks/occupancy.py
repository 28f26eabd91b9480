"""Find points inside solid objects, where neither a gateway nor a transmitter can be."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal, NamedTuple

import numpy as np
from jaxtyping import Bool, Float
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation
from trimesh import Trimesh
from trimesh.triangles import closest_point

from scenes.scene.antennas import Gateway
from scenes.scene.description import Scene, SceneObject

CHUNK = 200_000  # Pairs of a point and a triangle that are computed at a time. This limits the memory.

BLOCK, FAR = 64, 3
"""Triangles of a fine mesh in a block, and its distance over its size from which it counts as a single triangle."""

TOUCHING = 1e-3
"""Metres. Rays from an element that is nearer to a surface may start on either side of it."""


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


def rough_winding_number(
    points: Float[np.ndarray, "n 3"], triangles: Float[np.ndarray, "t 3 3"]
) -> Float[np.ndarray, " n"]:
    """``winding_number`` to within 0.1, in which a block of triangles far from a point counts as a single one."""
    if len(triangles) <= BLOCK:
        return winding_number(points, triangles)
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]) / 2
    middles = triangles.mean(axis=1)
    total = np.zeros(len(points))
    for block in np.array_split(cKDTree(middles, leafsize=BLOCK).indices, len(triangles) // BLOCK):
        middle = np.average(middles[block], axis=0, weights=np.linalg.norm(normals[block], axis=1))
        size = np.linalg.norm(triangles[block] - middle, axis=2).max()
        ways = middle - points
        distances = np.linalg.norm(ways, axis=1)
        near = distances < FAR * size
        total[~near] += (ways @ normals[block].sum(axis=0))[~near] / (4 * np.pi * distances[~near] ** 3)
        total[near] += winding_number(points[near], triangles[block])
    return total


def holds_antennas(scene: Scene, part: Trimesh) -> bool:
    """Whether a closed part is the room: it contains the gateway and the whole transmitter region."""
    # The region is shrunk by a thousandth. A region that reaches the walls is still inside the room.
    corners = scene.transmitter.corners()
    corners = corners + 1e-3 * (corners.mean(axis=0) - corners)
    antennas = np.vstack([corners, scene.gateway.position])
    if not _in_box(antennas, part).all():  # as for furniture and most buildings
        return False
    return bool((np.abs(rough_winding_number(antennas, part.triangles)) > 0.5).all())


def _in_box(points: Float[np.ndarray, "n 3"], part: Trimesh) -> Bool[np.ndarray, " n"]:
    low, high = part.bounds
    return ((points > low) & (points < high)).all(axis=1)


def blocking_object(scene: Scene, points: Float[np.ndarray, "n 3"]) -> list[str | None]:
    """The object that contains each point: a closed part that does not hold the antennas, as a room does."""
    points = np.asarray(points, dtype=float)
    blocker: list[str | None] = [None] * len(points)
    for item in scene.objects:
        for part in item.closed_parts:
            near = np.flatnonzero(_in_box(points, part))
            if not len(near) or holds_antennas(scene, part):
                continue
            for index in near[np.abs(rough_winding_number(points[near], part.triangles)) > 0.5]:
                blocker[index] = item.name
    return blocker


def inside_object(scene: Scene, points: Float[np.ndarray, "n 3"]) -> Bool[np.ndarray, " n"]:
    """Whether each point (metres, world frame) is inside an object, see ``blocking_object``."""
    return np.array([name is not None for name in blocking_object(scene, points)], dtype=bool)


class Obstruction(NamedTuple):
    """An element of an array that is not in the open."""

    element: Float[np.ndarray, " 3"]  # position of the element, metres, world frame
    object: str  # name of the object
    where: Literal["on", "behind"]  # "on" the object's surface, or "behind" it as seen from the gateway's position


def element_positions(gateway: Gateway, wavelength: float) -> Float[np.ndarray, "elements 3"]:
    """Return the positions of a gateway's elements, metres, world frame."""
    if gateway.elements is not None:
        turned = Rotation.from_quat(gateway.orientation).apply(np.array(gateway.elements))
        return np.asarray(gateway.position) + turned
    row, column = np.divmod(np.arange(gateway.rows * gateway.columns), gateway.columns)
    local = np.stack([column - (gateway.columns - 1) / 2, row - (gateway.rows - 1) / 2, 0 * row], axis=1)
    turned = Rotation.from_quat(gateway.orientation).apply(local)
    return np.asarray(gateway.position) + gateway.spacing * wavelength * turned


def obstruction(gateway: Gateway, wavelength: float, objects: Iterable[SceneObject]) -> Obstruction | None:
    """Find an element on an object's surface, or behind one as seen from the gateway's position."""
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
