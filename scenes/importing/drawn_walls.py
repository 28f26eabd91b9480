"""What becomes of the walls of an imported scene, and which of them would count twice."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from scenes.checks.coincident_faces import drawn_twice
from scenes.files.errors import named
from scenes.importing.lengths import plain
from scenes.importing.material_rules import listed
from scenes.importing.thick_walls import plates_of, walls_as_sheets
from scenes.scene.description import Scene
from scenes.scene.permittivity import is_conductor

Walls = Literal["as-sheets", "as-drawn"]
"""Whether walls that are drawn as boxes become sheets, or keep both faces."""

OVERLAP = 1.8
"""Thicknesses of the slab up to which the slabs of a body's two faces clearly overlap. At 2 they share the body."""

LARGE = 1.0
"""Metres. Smaller bodies that count twice hardly matter."""


@dataclass(frozen=True)
class DrawnWalls:
    """An imported scene, and what is to be said about its walls.

    Attributes:
        scene: the scene.
        sheets: thickness of the slab in metres of each object that was drawn as boxes and is now sheets, by name.
        assumed: sentences about what was made of the walls.
        warnings: sentences about surfaces that count twice.
    """

    scene: Scene
    sheets: dict[str, float]
    assumed: tuple[str, ...]
    warnings: tuple[str, ...]


def drawn_walls(scene: Scene, walls: Walls) -> DrawnWalls:
    """Treat the walls of a scene as the user wants it.

    Args:
        scene: the scene, with walls as they are drawn.
        walls: what becomes of walls and boards that are drawn as boxes.
    """
    if walls == "as-drawn":
        twice = [item.name for item in scene.objects if plates_of(scene, item)]
        twice += [name for name in counted_twice(scene) if name not in twice]
        remedy = "--walls as-sheets makes a sheet of each that is a plain box"
        sentence = f"waves pass a slab at both faces of {listed(twice)}, which are solid; {remedy}"
        return DrawnWalls(scene, {}, (), (*([sentence] if twice else []), *_coincident(scene)))
    scene, sheets = walls_as_sheets(scene)
    each = listed(f"{name} ({plain(thickness)} m)" for name, thickness in sheets.items())
    made = (
        f"made one sheet of each box that is about as thick as its material, and so is one slab: {each}; --walls "
        "as-drawn keeps both faces"
    )
    return DrawnWalls(scene, sheets, (made,) if sheets else (), (*_bodies(scene), *_coincident(scene)))


def counted_twice(scene: Scene) -> dict[str, float]:
    """Find objects with a large solid body, such as the walls of a house drawn as one body.

    Args:
        scene: the scene. Walls that are drawn as boxes count, too, until they are sheets.

    Returns:
        Thickness of the thickest of these bodies in metres, by name of the object.
    """
    found: dict[str, float] = {}
    for item in scene.objects:
        if is_conductor(scene.materials[item.material], scene.frequency):
            continue
        large = [part for part in item.closed_parts if np.sort(part.extents)[1] > LARGE]
        # Twice the volume over the area is nearly the thickness of a thin body, whatever its shape.
        thicknesses = [2 * abs(part.volume) / part.area for part in large]
        solid = [each for each in thicknesses if each < OVERLAP * scene.thickness(item)]
        if solid:
            found[item.name] = max(solid)
    return found


def _bodies(scene: Scene) -> list[str]:
    twice = counted_twice(scene)
    if not twice:
        return []
    name, thickness = max(twice.items(), key=lambda pair: pair[1])
    return [
        f"waves pass a slab at both faces of {listed(twice)}, which are solid but no plain boxes; draw each of their "
        f"walls as a box or a sheet of its own, or share the slab between the faces in scene.yaml (thickness: "
        f"{plain(thickness / 2)} for {named(name)})"
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
