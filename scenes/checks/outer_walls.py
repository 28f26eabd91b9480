"""Find the outer walls of a scene: surfaces that have everything else, antennas included, on one side."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float
from scipy.spatial import ConvexHull

from scenes.checks.enclosure import WALL_REACH
from scenes.scene.description import Scene

AT_ONCE = 10_000_000
"""Pairs of a triangle and a corner of the scene that are compared at a time. This bounds the memory."""


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
