"""Find the outer walls of a scene: surfaces that have everything else, antennas included, on one side."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float
from scipy.spatial import ConvexHull

from scenes.checks.enclosure import WALL_REACH
from scenes.scene.description import Scene


def in_outer_wall(scene: Scene, triangles: Float[np.ndarray, "n 3 3"]) -> Bool[np.ndarray, " n"]:
    """Whether all of the scene is on one side of each triangle's plane, to within ``WALL_REACH``.

    Args:
        scene: the scene.
        triangles: corners of the triangles, metres, world frame.
    """
    _, front, back = scene_beyond(scene, triangles)
    return np.minimum(front, back) < WALL_REACH


def scene_beyond(
    scene: Scene, triangles: Float[np.ndarray, "n 3 3"]
) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, " n"], Float[np.ndarray, " n"]]:
    """Return unit normals of triangles, and how far objects and antennas reach in front of and behind them, metres.

    Args:
        scene: the scene.
        triangles: corners of the triangles, metres, world frame.
    """
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normals = normals / np.linalg.norm(normals, axis=1, keepdims=True).clip(1e-30)
    gateways = [gateway.position for gateway in (scene.gateway, *scene.further_gateways.values())]
    points = np.vstack([*(item.mesh.vertices for item in scene.objects), scene.transmitter.corners(), gateways])
    points = points[ConvexHull(points, qhull_options="QJ").vertices]
    beyond = normals @ points.T - (normals * triangles[:, 0]).sum(axis=1, keepdims=True)
    return normals, beyond.max(axis=1), -beyond.min(axis=1)
