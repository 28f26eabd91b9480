"""What becomes of the walls of an imported scene, and which of them would count twice."""

from __future__ import annotations

from collections import Counter
from collections.abc import Container
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from scenes.files.errors import listed
from scenes.files.lengths import plain
from scenes.importing.thick_walls import SOLID, flat_faces, plates, walls_as_sheets
from scenes.scene.connected_parts import shared_corners
from scenes.scene.description import Scene, SceneObject, conducting_objects
from scenes.scene.materials import is_conductor
from scenes.scene.shapes import union

Walls = Literal["as-sheets", "as-drawn"]
"""Whether walls that are drawn as boxes become sheets, or keep both faces."""

LARGE = 1.0  # Metres. Smaller bodies that count twice hardly matter.

DECIMALS = 4  # Corners that agree in so many, metres, are the same

NEAREST = 1e-3  # Metres. Faces nearer than this lie on one another, which is told by itself.

LEAST_AREA = 1.0  # Square metres that lie opposite others at least

MOSTLY = 0.3  # Least share of the area that lies opposite others


@dataclass(frozen=True)
class DrawnWalls:
    """An imported scene, and what is to be said about its walls."""

    scene: Scene  # the scene
    sheets: dict[str, float]  # thickness of the slab, metres, of each object that is sheets now, by name
    assumed: tuple[str, ...]  # sentences about what was made of the walls
    warnings: tuple[str, ...]  # sentences about surfaces that count twice


def drawn_walls(scene: Scene, walls: Walls) -> DrawnWalls:
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
        if apart := two_sided_walls(scene, {*sheets, *twice}):
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
    corners = shared_corners(triangles.reshape(-1, 3), DECIMALS).reshape(-1, 3)
    keys = shared_corners(np.sort(corners, axis=1), 0)
    order = np.argsort(keys, kind="stable")
    same = np.flatnonzero(keys[order][1:] == keys[order][:-1])
    first, second = owner[order[same]], owner[order[same + 1]]
    conducts = conducting_objects(scene)
    counted = ~(conducts[first] & conducts[second])
    pairs = Counter(zip(first[counted].tolist(), second[counted].tolist(), strict=True))
    return {(scene.objects[a].name, scene.objects[b].name): count for (a, b), count in pairs.items()}


def two_sided_walls(scene: Scene, others: Container[str]) -> dict[str, float]:
    """Parts of a scene with two large parallel faces so near to one another that their slabs meet, and the distance."""
    walls: dict[tuple[str, str], list[SceneObject]] = {}
    for item in scene.objects:
        if item.name not in others and not is_conductor(scene.materials[item.material], scene.frequency):
            walls.setdefault((item.name.partition("/")[0], item.material), []).append(item)
    found: dict[str, float] = {}
    for (name, _), items in walls.items():
        mesh = union(*(item.mesh for item in items))
        mesh.merge_vertices()
        faces = flat_faces(mesh)
        # Either side of a sheet may be its front.
        pairs = plates(
            [*faces, *(replace(each, normal=-each.normal) for each in faces)], SOLID * max(map(scene.thickness, items))
        )
        apart = {pair: distance for pair, distance in pairs.items() if distance > NEAREST}
        area = sum(faces[number].area for number in {number % len(faces) for pair in apart for number in pair})
        if area >= max(LEAST_AREA, MOSTLY * mesh.area):
            found[name] = min(float(np.median(list(apart.values()))), found.get(name, np.inf))
    return found
