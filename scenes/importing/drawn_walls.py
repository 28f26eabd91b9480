"""What becomes of the walls of an imported scene, and which of them would count twice."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from scenes.checks.coincident_faces import drawn_twice
from scenes.importing.lengths import plain
from scenes.importing.material_rules import listed
from scenes.importing.thick_walls import SOLID, walls_as_sheets
from scenes.importing.two_sided_walls import two_sided_walls
from scenes.scene.description import Scene
from scenes.scene.permittivity import is_conductor

Walls = Literal["as-sheets", "as-drawn"]
"""Whether walls that are drawn as boxes become sheets, or keep both faces."""

LARGE = 1.0
"""Metres. Smaller bodies that count twice hardly matter."""


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
    if walls == "as-drawn":
        left = {item.name: item for item in as_sheets.objects}
        twice = [item.name for item in scene.objects if left.get(item.name) is not item]
        twice += [name for name in counted_twice(scene) if name not in twice]
        remedy = "--walls as-sheets makes sheets of those that consist of plates"
        sentence = f"waves pass a slab at both faces of {listed(twice)}, which are solid; {remedy}"
        return DrawnWalls(scene, {}, (), (*([sentence] if twice else []), *_coincident(scene)))
    each = listed(f"{name} ({plain(thickness)} m)" for name, thickness in sheets.items())
    made = (
        f"made one sheet, with one slab, of each wall and board that is drawn with both its faces: {each}; --walls "
        "as-drawn keeps the faces"
    )
    warnings = (*_solid(as_sheets), *_two_sided(as_sheets, sheets), *_coincident(as_sheets))
    return DrawnWalls(as_sheets, sheets, (made,) if sheets else (), warnings)


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


def _solid(scene: Scene) -> list[str]:
    twice = counted_twice(scene)
    if not twice:
        return []
    return [
        f"waves pass a slab at both faces of {listed(twice)}, which are solid but do not consist of plates; draw each "
        "of their walls as a box or a sheet of its own"
    ]


def _two_sided(scene: Scene, sheets: Iterable[str]) -> list[str]:
    apart = two_sided_walls(scene, {*sheets, *counted_twice(scene)}, SOLID)
    if not apart:
        return []
    each = listed(f"{name} ({plain(distance)} m)" for name, distance in apart.items())
    return [
        f"large faces lie near one another, so that waves pass a slab at each: {each}; if they are the two sides of "
        "one wall, draw it as a box with one material, or as one sheet"
    ]


def _coincident(scene: Scene) -> list[str]:
    pairs = drawn_twice(scene)
    if not pairs:
        return []
    most, _ = max(pairs.items(), key=lambda each: each[1])
    return [
        f"{sum(pairs.values())} triangles lie exactly on another one, such as in {listed(most)}; each counts as "
        "a slab of its own"
    ]
