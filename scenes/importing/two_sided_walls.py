"""Find walls whose two sides are drawn, but not as one body: shells, skins without rims, sides of two objects."""

from __future__ import annotations

from collections.abc import Container

import numpy as np
from jaxtyping import Bool, Float

from scenes.checks.depth_buffer import barycentric
from scenes.scene.description import Scene, SceneObject
from scenes.scene.permittivity import is_conductor

PARALLEL = float(np.cos(np.radians(1.0)))
"""Least cosine of the angle between the normals of two sides."""

NEAREST = 1e-3
"""Metres. Faces nearer than this lie on one another, which is told by itself."""

SAMPLED = 64
"""Triangles of an object, the largest ones, that are looked at."""

MOST_TRIANGLES = 20_000
"""Objects of more triangles are terrain, or drawn in too much detail to be walls."""

LEAST_AREA = 1.0
"""Square metres that lie opposite others at least."""

MOSTLY = 0.3
"""Least share of the area looked at that lies opposite others."""


def two_sided_walls(scene: Scene, others: Container[str], solid: float) -> dict[str, float]:
    """Parts of a scene with two large parallel faces so near to one another that their slabs meet.

    The objects that an import makes of one node are looked at together if they have the same radio material:
    "wall/outside" and "wall/inside". Faces of two materials are layers, each a slab of its own.

    >>> from dataclasses import replace
    >>> from scenes.places.closet import closet
    >>> from scenes.scene.shapes import sheet, union
    >>> skins = union(*(sheet((0, y, 0), (2, 0, 0), (0, 0, 2)) for y in (0.4, 0.5)))
    >>> scene = replace(closet(), objects=(SceneObject("partition", skins, "brick"),))
    >>> two_sided_walls(replace(scene, materials=closet().materials), (), 2.0)
    {'partition': 0.1}
    """
    walls: dict[tuple[str, str], list[SceneObject]] = {}
    for item in scene.objects:
        if item.name not in others and not is_conductor(scene.materials[item.material], scene.frequency):
            walls.setdefault((item.name.partition("/")[0], item.material), []).append(item)
    found: dict[str, float] = {}
    for (name, _), items in walls.items():
        if sum(len(item.mesh.faces) for item in items) <= MOST_TRIANGLES:
            triangles = np.concatenate([item.mesh.triangles for item in items])
            distance = _apart(triangles, solid * max(scene.thickness(item) for item in items))
            if distance is not None:
                found[name] = min(distance, found.get(name, distance))
    return found


def _apart(triangles: Float[np.ndarray, "n 3 3"], farthest: float) -> float | None:
    """The median distance of the large faces that lie opposite one another, metres. None: there are too few."""
    across = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    areas = np.linalg.norm(across, axis=1) / 2
    normals = across / np.maximum(2 * areas, 1e-30)[:, None]
    largest = np.argsort(-areas, kind="stable")[:SAMPLED]
    distances = np.array([_nearest(triangles, normals, number, farthest) for number in largest])
    near = np.isfinite(distances)
    area = float(areas[largest][near].sum())
    if area < LEAST_AREA or area < MOSTLY * float(areas[largest].sum()):
        return None
    return round(float(np.median(distances[near])), 4)


def _nearest(
    triangles: Float[np.ndarray, "n 3 3"], normals: Float[np.ndarray, "n 3"], number: int, farthest: float
) -> float:
    """Distance along its normal from the middle of a triangle to the nearest parallel one; infinite if none is near."""
    normal, middle = normals[number], triangles[number].mean(axis=0)
    height = (triangles[:, 0] - middle) @ normal
    near: Bool[np.ndarray, " n"] = (np.abs(height) > NEAREST) & (np.abs(height) <= farthest)
    candidates = np.flatnonzero(near & (np.abs(normals @ normal) > PARALLEL))
    if not len(candidates):
        return np.inf
    one = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
    plane = np.stack([one, np.cross(normal, one)], axis=1)
    a, b, c = np.moveaxis((triangles[candidates] - middle) @ plane, 1, 0)
    covers = barycentric(a, b, c)[1]
    return float(np.abs(height[candidates][covers]).min(initial=np.inf))
