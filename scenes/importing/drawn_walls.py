"""What becomes of the walls of an imported scene, and which of them would count twice."""

from __future__ import annotations

from collections import Counter
from collections.abc import Container
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float, UInt64

from scenes.checks.enclosure import barycentric
from scenes.files.lengths import plain
from scenes.importing.material_rules import listed
from scenes.importing.thick_walls import SOLID, walls_as_sheets
from scenes.scene.description import Scene, SceneObject, conducting_objects
from scenes.scene.materials import is_conductor

Walls = Literal["as-sheets", "as-drawn"]
"""Whether walls that are drawn as boxes become sheets, or keep both faces."""

LARGE = 1.0  # Metres. Smaller bodies that count twice hardly matter.

SAME = 1e-4  # Metres. Corners nearer than this are the same.

FACTORS = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], dtype=np.uint64)
"""Odd numbers that mix the three coordinates of a corner."""

PARALLEL = float(np.cos(np.radians(1.0)))  # Least cosine of the angle between the normals of two sides

NEAREST = 1e-3  # Metres. Faces nearer than this lie on one another, which is told by itself.

SAMPLED = 64  # Triangles of an object, the largest ones, that are looked at

MOST_TRIANGLES = 20_000
"""Objects of more triangles are terrain, or drawn in too much detail to be walls."""

LEAST_AREA = 1.0  # Square metres that lie opposite others at least

MOSTLY = 0.3  # Least share of the area looked at that lies opposite others


@dataclass(frozen=True)
class DrawnWalls:
    """An imported scene, and what is to be said about its walls."""

    scene: Scene  # the scene
    # thickness of the slab in metres of each object that was drawn as boxes and is now sheets, by name
    sheets: dict[str, float]
    assumed: tuple[str, ...]  # sentences about what was made of the walls
    warnings: tuple[str, ...]  # sentences about surfaces that count twice


def drawn_walls(scene: Scene, walls: Walls) -> DrawnWalls:
    """Treat the walls of a scene as the user wants it."""
    as_sheets, sheets = walls_as_sheets(scene)
    warnings, assumed = [], []
    if walls == "as-drawn":
        left = {item.name: item for item in as_sheets.objects}
        twice = [item.name for item in scene.objects if left.get(item.name) is not item]
        twice += [name for name in counted_twice(scene) if name not in twice]
        if twice:
            remedy = "--walls as-sheets makes sheets of those that consist of plates"
            warnings.append(f"waves pass a slab at both faces of {listed(twice)}, which are solid; {remedy}")
        sheets = {}
    else:
        scene, twice = as_sheets, counted_twice(as_sheets)
        if sheets:
            each = listed(f"{name} ({plain(thickness)} m)" for name, thickness in sheets.items())
            assumed.append(
                "made one sheet, with one slab, of each wall and board that is drawn with both its faces: "
                f"{each}; --walls as-drawn keeps the faces"
            )
        if twice:
            warnings.append(
                f"waves pass a slab at both faces of {listed(twice)}, which are solid but do not consist of plates; "
                "draw each of their walls as a box or a sheet of its own"
            )
        if apart := two_sided_walls(scene, {*sheets, *twice}, SOLID):
            each = listed(f"{name} ({plain(distance)} m)" for name, distance in apart.items())
            warnings.append(
                f"large faces lie near one another, so that waves pass a slab at each: {each}; if they are the two "
                "sides of one wall, draw it as a box with one material, or as one sheet"
            )
    if pairs := drawn_twice(scene):
        most, _ = max(pairs.items(), key=lambda each: each[1])
        warnings.append(
            f"{sum(pairs.values())} triangles lie exactly on another one, such as in {listed(most)}; each counts as "
            "a slab of its own"
        )
    return DrawnWalls(scene, sheets, tuple(assumed), tuple(warnings))


def counted_twice(scene: Scene) -> list[str]:
    """Return the names of objects with a large solid body."""
    found = []
    for item in scene.objects:
        if not is_conductor(scene.materials[item.material], scene.frequency):
            large = [part for part in item.closed_parts if np.sort(part.extents)[1] > LARGE]
            # Twice the volume over the area is nearly the thickness of a thin body, whatever its shape.
            if any(2 * abs(part.volume) < SOLID * scene.thickness(item) * part.area for part in large):
                found.append(item.name)
    return found


def drawn_twice(scene: Scene) -> dict[tuple[str, str], int]:
    """Count triangles with the corners of another one, by names; a wave meets only the first of two conductors."""
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


def two_sided_walls(scene: Scene, others: Container[str], solid: float) -> dict[str, float]:
    """Parts of a scene with two large parallel faces so near to one another that their slabs meet."""
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
