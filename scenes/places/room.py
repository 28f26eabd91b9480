"""What the built-in places are built of: floor, ceiling, walls with openings, and furniture that suits the ray tracer.

The floor is z = 0 with a corner at the origin; the room spans 0 … length along x, 0 … width along y.

Geometric optics holds for surfaces of about a wavelength (33 cm at 915 MHz) and more. Legs, edges, feet and chairs are
left out, since they do not reflect like mirrors. A board is one sheet, not a box: the ray tracer's material already is
a slab with a thickness, and two faces would make it two slabs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from trimesh import Trimesh

from scenes.scene.description import Gateway, Scene, SceneObject, Transmitter
from scenes.scene.materials import p2040_materials
from scenes.scene.shapes import rotate, sheet, union

FREQUENCY = 915e6  # Hz, the RFID band of NeRF²'s measurements

Side = Literal["south", "north", "west", "east"]

BEHIND = 0.05
"""Metres that a pane sits behind its wall and reaches beyond its opening, so that nothing lies in the wall's plane and
no ray passes between pane and wall."""

GAP = 0.002
"""Metres between objects that would touch, since surfaces in one plane would be hit in an arbitrary order."""


@dataclass(frozen=True)
class Opening:
    """A window or door: a rectangle left out of a wall, and the sheet that closes it.

    Attributes:
        name: of the sheet.
        side: the wall.
        start: metres along the wall, from its low x (south, north) or low y (west, east) end.
        end: metres along the wall.
        bottom: metres above the floor.
        top: metres above the floor.
        material: the sheet's.
        thickness: the sheet's, metres; the material's own if None.
    """

    name: str
    side: Side
    start: float
    end: float
    bottom: float
    top: float
    material: str = "glass"
    thickness: float | None = None


@dataclass(frozen=True)
class Finish:
    """What a floor, ceiling or wall is made of, and how thick (metres; the material's own if None)."""

    material: str
    thickness: float | None = None


def build_room(
    size: tuple[float, float, float],
    openings: Sequence[Opening],
    *,
    floor: Finish,
    ceiling: Finish,
    south: Finish,
    north: Finish,
    west: Finish,
    east: Finish,
) -> list[SceneObject]:
    """Floor, ceiling, the four walls and the panes and doors in their openings.

    Args:
        size: length, width and height, metres.
    """
    length, width, height = size
    x, y, up = np.array([length, 0.0, 0.0]), np.array([0.0, width, 0.0]), np.array([0.0, 0.0, height])
    # Corner, edge along the wall, the way out, and the wall's finish.
    walls: dict[Side, tuple[np.ndarray, np.ndarray, np.ndarray, Finish]] = {
        "south": (np.zeros(3), x, -y / width, south),
        "north": (y, x, y / width, north),
        "west": (np.zeros(3), y, -x / length, west),
        "east": (x, y, x / length, east),
    }
    objects = [
        SceneObject("floor", sheet((0, 0, 0), x, y), floor.material, floor.thickness),
        SceneObject("ceiling", sheet(up, y, x), ceiling.material, ceiling.thickness),
    ]
    for side, (corner, along, _, finish) in walls.items():
        holes = [(o.start, o.end, o.bottom, o.top) for o in openings if o.side == side]
        objects.append(SceneObject(f"wall {side}", sheet(corner, along, up, holes), finish.material, finish.thickness))
    for o in openings:
        corner, along, out, _ = walls[o.side]
        direction = along / np.linalg.norm(along)
        bottom = max(GAP, o.bottom - BEHIND)
        start = corner + (o.start - BEHIND) * direction + BEHIND * out + [0, 0, bottom]
        pane = sheet(start, (o.end - o.start + 2 * BEHIND) * direction, (0, 0, o.top + BEHIND - bottom))
        objects.append(SceneObject(o.name, pane, o.material, o.thickness))
    return objects


def table(x: float, y: float, length: float, width: float, height: float = 0.74) -> Trimesh:
    """A table's board, its corner of lowest x and y at (x, y); metres."""
    return sheet((x, y, height), (length, 0, 0), (0, width, 0))


def panel(x: float, y: float, length: float, bottom: float, top: float, degrees: float = 0.0) -> Trimesh:
    """An upright sheet centred on (x, y), along x before it is rotated; metres, degrees."""
    return rotate(sheet((x - length / 2, y, bottom), (length, 0, 0), (0, 0, top - bottom)), degrees)


def shelf(x: float, y: float, length: float, width: float, heights: Sequence[float]) -> Trimesh:
    """Horizontal boards one above the other, without sides; metres."""
    return union(*(table(x, y, length, width, height) for height in heights))


def build_place(name: str, objects: Sequence[SceneObject], gateway: Gateway, transmitter: Transmitter) -> Scene:
    """A built-in place at 915 MHz; its materials are those of ITU-R P.2040."""
    materials = p2040_materials((item.material for item in objects), FREQUENCY)
    return Scene(name, FREQUENCY, gateway, transmitter, tuple(objects), materials)
