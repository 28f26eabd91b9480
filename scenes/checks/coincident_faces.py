"""Find triangles that are drawn twice, each of which would count as a slab of its own."""

from __future__ import annotations

from collections import Counter

import numpy as np
from jaxtyping import Float, UInt64

from scenes.scene.description import Scene
from scenes.scene.permittivity import conducting_objects

SAME = 1e-4
"""Metres. Corners nearer than this are the same."""

FACTORS = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], dtype=np.uint64)
"""Odd numbers that mix the three coordinates of a corner."""


def drawn_twice(scene: Scene) -> dict[tuple[str, str], int]:
    """Count the triangles that have the same corners as another one, by the names of both objects.

    Conductors on conductors are left out, since a wave meets only the first of them.

    >>> from dataclasses import replace
    >>> from scenes.places.closet import closet
    >>> table = next(item for item in closet().objects if item.name == "table")
    >>> drawn_twice(replace(closet(), objects=(*closet().objects, replace(table, name="plate"))))
    {('table', 'plate'): 2}
    """
    triangles = np.concatenate([item.mesh.triangles for item in scene.objects])
    owner = np.repeat(np.arange(len(scene.objects)), [len(item.mesh.faces) for item in scene.objects])
    keys = _keys(triangles)
    order = np.argsort(keys, kind="stable")
    same = np.flatnonzero(keys[order][1:] == keys[order][:-1])
    first, second = owner[order[same]], owner[order[same + 1]]
    conducts = conducting_objects(scene)
    counted = ~(conducts[first] & conducts[second])
    pairs = Counter(zip(first[counted].tolist(), second[counted].tolist(), strict=True))
    return {(scene.objects[a].name, scene.objects[b].name): count for (a, b), count in pairs.items()}


def _keys(triangles: Float[np.ndarray, "n 3 3"]) -> UInt64[np.ndarray, " n"]:
    """A hash of each triangle's corners that does not depend on their order."""
    corners = (np.round(triangles / SAME).astype(np.int64).view(np.uint64) * FACTORS).sum(axis=-1)
    corners ^= corners >> np.uint64(31)  # a sum alone would be that of another triangle with the same centre
    corners *= FACTORS[0]
    corners ^= corners >> np.uint64(29)
    return corners.sum(axis=-1)
