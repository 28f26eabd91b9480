"""Find the floor, walls and ceiling of a scene, and where a drawing opens them to show the inside."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float
from scipy.spatial import ConvexHull
from trimesh.intersections import slice_faces_plane

from scenes.scene.description import Scene, SceneObject
from scenes.scene.shapes import bounding_box

Plane = tuple[Float[np.ndarray, " 3"], Float[np.ndarray, " 3"]]
"""A point of a plane, metres, and the normal, which points to the side that is drawn."""

UNDER_CEILING = 0.05
"""Distance below the ceiling at which a room is opened, metres. It removes slightly sloped ceilings, too."""

WALL_REACH = 0.4
"""Distance from the outermost surface within which a wall's inner side, windows and doors are, metres."""

AT_ONCE = 10_000_000
"""Pairs of a triangle and a corner of the scene that are compared at a time. This bounds the memory."""


def barycentric(
    a: Float[np.ndarray, "n 2"], b: Float[np.ndarray, "n 2"], c: Float[np.ndarray, "n 2"]
) -> tuple[Float[np.ndarray, "n 3"], Bool[np.ndarray, " n"]]:
    """Return the barycentric coordinates of the origin in flat triangles, and whether each triangle covers it."""
    parts = np.stack([u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0] for u, v in ((b, c), (c, a), (a, b))], axis=1)
    whole = parts.sum(axis=1, keepdims=True)
    weights = parts / np.where(whole == 0, np.nan, whole)  # a triangle seen edge-on covers nothing
    return weights, np.all(weights >= 0, axis=1)


def enclosing(scene: Scene, item: SceneObject, triangles: Float[np.ndarray, "n 3 3"]) -> Bool[np.ndarray, " n"]:
    """Whether each triangle of an object encloses the scene: floor, walls, ceiling, windows and doors."""
    low, high = scene.bounds
    box = item.mesh.bounds
    wide = np.ptp(box, axis=0) > 0.5 * (high - low)
    against = np.minimum(box[1] - low, high - box[0]) < 0.25  # m; a thick wall or slab at the edge
    if any(against[axis] and np.delete(wide, axis).all() for axis in range(3)):
        return np.ones(len(triangles), dtype=bool)
    flush = (triangles.max(axis=1) < low + 0.06) | (triangles.min(axis=1) > high - 0.06)  # windows, doors
    return flush[:, 2] | (flush[:, :2].any(axis=1) & wide[2])


def cut(triangles: Float[np.ndarray, "n 3 3"], planes: Sequence[Plane]) -> Float[np.ndarray, "m 3 3"]:
    """Cut triangles and keep the parts on the drawn side of every plane."""
    for origin, normal in planes:
        corners, faces = triangles.reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3)
        corners, faces, _ = slice_faces_plane(corners, faces, normal, origin)
        triangles = corners[faces]
    return triangles


def ceiling_height(scene: Scene, triangles: Float[np.ndarray, "n 3 3"]) -> float:
    """The height of the ceiling above gateways and region, metres; infinite if one has none, or nothing is below it."""
    low, high = scene.transmitter.region
    gateways = (scene.gateway, *scene.further_gateways.values())
    around = bounding_box(np.vstack([scene.transmitter.region, *(gateway.position for gateway in gateways)]))
    corners = triangles.min(axis=1), triangles.max(axis=1)
    near = triangles[((corners[0] <= around[1]) & (corners[1] >= around[0]))[:, :2].all(axis=1)]
    steps = [(0.1, 0.3, 0.5, 0.7, 0.9)] * 2
    spread = np.stack(np.meshgrid(*steps), axis=-1).reshape(-1, 2)
    over_region = [lowest_above(np.array([*point, high[2]]), near) for point in low[:2] + spread * (high - low)[:2]]
    over_gateways = [lowest_above(np.array(gateway.position), near) for gateway in gateways]
    # The median, since a lamp or a duct above a part of the region is not a ceiling.
    heights = [float(np.median(over_region)), *over_gateways]
    below = triangles[:, :, 2].min() < min(heights) - UNDER_CEILING
    return min(heights) if max(heights) < np.inf and below else np.inf


def lowest_above(point: Float[np.ndarray, " 3"], triangles: Float[np.ndarray, "n 3 3"]) -> float:
    """Return the height of the first surface straight above a point, metres, or infinity if there is none."""
    a, b, c = np.moveaxis(triangles[:, :, :2] - point[:2], 1, 0)
    weights, covered = barycentric(a, b, c)
    heights = (weights[covered] * triangles[covered][:, :, 2]).sum(axis=1)
    return float(heights[heights > point[2]].min(initial=np.inf))


def opened_ceiling(height: float) -> list[Plane]:
    """Return the plane just below a ceiling at a height in metres, or none for an infinite height."""
    return [(np.array([0, 0, height - UNDER_CEILING]), np.array([0.0, 0.0, -1.0]))] if height < np.inf else []


def opened_walls(
    scene: Scene, triangles: Float[np.ndarray, "n 3 3"], viewer: Float[np.ndarray, " 3"], roofed: bool
) -> list[Plane]:
    """The inner sides of a room's outer walls between viewer and inside. A room has a ceiling or three outer walls."""
    walls = _outer_walls(scene, triangles)
    if not roofed and len(walls) < 3:
        return []
    # A millimetre inside, so that the wall's own surface is removed.
    return [((offset - 1e-3) * out, -out) for out, offset in walls if out @ viewer > 0]


def _outer_walls(scene: Scene, triangles: Float[np.ndarray, "n 3 3"]) -> list[tuple[np.ndarray, float]]:
    """Return the outward normal of each outer wall, and the distance of its inner side from the origin."""
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True).clip(1e-30)
    upright = np.abs(normals[:, 2]) < 0.02
    if not upright.any():
        return []
    points = triangles.reshape(-1, 3)
    points = points[ConvexHull(points, qhull_options="QJ").vertices]
    gateways = (scene.gateway, *scene.further_gateways.values())
    antennas = np.vstack([scene.transmitter.corners(), *(gateway.position for gateway in gateways)])
    low, high = bounding_box(points)
    inner: dict[int, tuple[np.ndarray, float]] = {}
    for sign in (1, -1):
        out = sign * normals[upright]
        degrees = np.degrees(np.arctan2(out[:, 1], out[:, 0])).round().astype(int) % 360
        order = np.argsort(degrees, kind="stable")
        angles, first = np.unique(degrees[order], return_index=True)
        for angle, chosen in zip(angles, np.split(triangles[upright][order], first[1:]), strict=True):
            normal = np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle)), 0.0])
            along = np.array([-normal[1], normal[0], 0.0])
            centimetres = (100 * (chosen @ normal).mean(axis=1)).round().astype(int)
            outermost, length = float((points @ normal).max()), np.ptp(points @ along)
            for place in np.unique(centimetres[centimetres > 100 * (outermost - WALL_REACH)]):
                wall = chosen[centimetres == place]
                high_enough = np.ptp(wall[:, :, 2]) > 0.5 * (high - low)[2]
                long_enough = np.ptp(wall @ along) > 0.5 * length and _gaps(wall @ along) < 1 / 3
                offset = float((wall @ normal).min())
                if high_enough and long_enough and (antennas @ normal < offset).all():
                    if angle not in inner or offset < inner[angle][1]:
                        inner[int(angle)] = normal, offset
    return list(inner.values())


def _gaps(along: Float[np.ndarray, "n 3"]) -> float:
    """Return the share of a wall's length where none of its triangles is, from their corners' places along it."""
    ends = np.column_stack([along.min(axis=1), along.max(axis=1)])
    ends = ends[ends[:, 0].argsort()]
    gaps = ends[1:, 0] - np.maximum.accumulate(ends[:-1, 1])
    return float(gaps.clip(0).sum() / max(np.ptp(ends), 1e-30))


def outline(scene: Scene) -> Float[np.ndarray, "points 3"]:
    """Return the corners of the convex hull of all objects and antennas, metres, world frame."""
    gateways = [gateway.position for gateway in (scene.gateway, *scene.further_gateways.values())]
    points = np.vstack([*(item.mesh.vertices for item in scene.objects), scene.transmitter.corners(), gateways])
    return points[ConvexHull(points, qhull_options="QJ").vertices]


def in_outer_wall(
    triangles: Float[np.ndarray, "n 3 3"], around: Float[np.ndarray, "points 3"]
) -> Bool[np.ndarray, " n"]:
    """Whether all of the scene is on one side of each triangle's plane, to within ``WALL_REACH``."""
    _, front, back = beyond(triangles, around)
    return np.minimum(front, back) < WALL_REACH


def beyond(
    triangles: Float[np.ndarray, "n 3 3"], around: Float[np.ndarray, "points 3"]
) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, " n"], Float[np.ndarray, " n"]]:
    """Return unit normals of triangles, and how far the scene reaches in front of and behind them, metres."""
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normals = normals / np.linalg.norm(normals, axis=1, keepdims=True).clip(1e-30)
    front, back = np.zeros(len(normals)), np.zeros(len(normals))
    step = max(1, AT_ONCE // len(around))
    for start in range(0, len(normals), step):
        part = slice(start, start + step)
        heights = normals[part] @ around.T - (normals[part] * triangles[part, 0]).sum(axis=1, keepdims=True)
        front[part], back[part] = heights.max(axis=1), -heights.min(axis=1)
    return normals, front, back
