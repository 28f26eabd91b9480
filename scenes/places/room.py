"""Parts of the built-in scenes: floor, ceiling, walls with openings, and furniture that suits the ray tracer.

The floor is at z = 0, with a corner at the origin. The room spans 0 to its length along x, and 0 to its width along y.

Geometric optics holds for surfaces of about a wavelength (33 cm at 915 MHz) or more. Legs, edges, feet and chairs are
left out, since they do not reflect like mirrors. A board is one sheet, not a box: in the ray tracer, each surface is
already a slab with a thickness, and two faces would be two slabs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from trimesh import Trimesh

from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.description import Scene, SceneObject
from scenes.scene.materials import p2040_materials
from scenes.scene.shapes import rotate, sheet, union

FREQUENCY = 915e6  # Hz, the RFID band of NeRF²'s measurements

Side = Literal["south", "north", "west", "east"]

BEHIND = 0.05
"""Distance of a pane behind its wall, and its overlap with the wall around the opening, metres. So nothing lies in the
plane of the wall, and no ray passes between pane and wall."""

GAP = 0.002
"""Gap between objects that would touch, metres. Rays hit coincident surfaces in an arbitrary order."""


@dataclass(frozen=True)
class Opening:
    """A window or door: an opening in a wall, and the sheet that closes it."""

    name: str  # name of the sheet
    side: Side  # the wall
    start: float  # start along the wall, metres from its end at low x (south, north) or low y (west, east)
    end: float  # end along the wall, metres
    bottom: float  # height of the lower edge, metres
    top: float  # height of the upper edge, metres
    material: str = "glass"  # material of the sheet
    thickness: float | None = None  # thickness of the sheet, metres; that of the material if None


@dataclass(frozen=True)
class Finish:
    """Material of a floor, ceiling or wall, and its thickness in metres (that of the material if None)."""

    material: str
    thickness: float | None = None


CONCRETE, BRICK, WOOD, PLASTERBOARD = Finish("concrete"), Finish("brick"), Finish("wood"), Finish("plasterboard", 0.10)


def build_room(
    size: tuple[float, float, float],
    openings: Sequence[Opening],
    floor: Finish,
    ceiling: Finish,
    finishes: Sequence[Finish],
    inner_corner: tuple[float, float] | None = None,
) -> list[SceneObject]:
    """Build floor, ceiling and the walls south, north, west and east, with windows and doors in their openings."""
    length, width, height = size
    inner_x, inner_y = inner_corner or (length, width)
    x, y, up = np.array([length, 0.0, 0.0]), np.array([0.0, width, 0.0]), np.array([0.0, 0.0, height])
    # Corner, vector along the wall, and outward normal of each wall.
    walls: dict[Side, tuple[np.ndarray, np.ndarray, np.ndarray]] = {
        "south": (np.zeros(3), x, -y / width),
        "north": (y, np.array([inner_x, 0.0, 0.0]), y / width),
        "west": (np.zeros(3), y, -x / length),
        "east": (x, np.array([0.0, inner_y, 0.0]), x / length),
    }
    below, above, inner = sheet((0, 0, 0), x, y), sheet(up, y, x), {}
    if inner_corner:
        below, above = _l_shape(size, inner_corner, 0.0), _l_shape(size, inner_corner, height)
        at = (inner_x, inner_y, 0)
        inner = {"north": sheet(at, (length - inner_x, 0, 0), up), "east": sheet(at, (0, width - inner_y, 0), up)}
    objects = [
        SceneObject("floor", below, floor.material, floor.thickness),
        SceneObject("ceiling", above, ceiling.material, ceiling.thickness),
    ]
    for (side, (corner, along, _)), finish in zip(walls.items(), finishes, strict=True):
        holes = [(o.start, o.end, o.bottom, o.top) for o in openings if o.side == side]
        wall = sheet(corner, along, up, holes)
        if side in inner:
            wall = union(wall, inner[side])
        objects.append(SceneObject(f"wall {side}", wall, finish.material, finish.thickness))
    for o in openings:
        corner, along, out = walls[o.side]
        direction = along / np.linalg.norm(along)
        bottom = max(GAP, o.bottom - BEHIND)
        start = corner + (o.start - BEHIND) * direction + BEHIND * out + [0, 0, bottom]
        pane = sheet(start, (o.end - o.start + 2 * BEHIND) * direction, (0, 0, o.top + BEHIND - bottom))
        objects.append(SceneObject(o.name, pane, o.material, o.thickness))
    return objects


def _l_shape(size: tuple[float, float, float], inner_corner: tuple[float, float], height: float) -> Trimesh:
    """The floor of an L-shaped room, or its ceiling if the height is not 0: triangles around the inner corner."""
    length, width, _ = size
    x, y = inner_corner
    outline = [(0, 0), (length, 0), (length, y), (x, y), (x, width), (0, width)]
    faces = [(3, 4, 5), (3, 5, 0), (3, 0, 1), (3, 1, 2)]
    if height:
        faces = [face[::-1] for face in faces]  # it faces down
    return Trimesh([(*corner, height) for corner in outline], faces, process=False)


def table(x: float, y: float, length: float, width: float, height: float = 0.74) -> Trimesh:
    """Make a table top whose corner of lowest x and y is at (x, y), in metres."""
    return sheet((x, y, height), (length, 0, 0), (0, width, 0))


def panel(x: float, y: float, length: float, bottom: float, top: float, degrees: float = 0.0) -> Trimesh:
    """Make an upright sheet centred on (x, y), along x before its rotation, in metres and degrees."""
    return rotate(sheet((x - length / 2, y, bottom), (length, 0, 0), (0, 0, top - bottom)), degrees)


def shelf(x: float, y: float, length: float, width: float, heights: Sequence[float]) -> Trimesh:
    """Make horizontal boards one above the other, without sides, in metres."""
    return union(*(table(x, y, length, width, height) for height in heights))


def build_place(name: str, objects: Sequence[SceneObject], gateway: Gateway, transmitter: Transmitter) -> Scene:
    """Make a built-in scene at 915 MHz with materials of ITU-R P.2040."""
    materials = p2040_materials((item.material for item in objects), FREQUENCY)
    return Scene(name, FREQUENCY, gateway, transmitter, tuple(objects), materials)
