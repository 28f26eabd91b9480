"""Kinds of furniture for random rooms: each a function that draws a piece of random size, and where it belongs.

A piece is made around the origin, with its back at y = 0 and its lowest point at z = 0, and faces −y. A room then turns
and moves it. Objects of thin boards are closed shells: hollow boxes whose faces are slabs.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation
from trimesh import Trimesh
from trimesh.creation import cylinder

from scenes.scene.shapes import box, sheet, union

Place = Literal["wall", "on the wall", "free", "ceiling"]
"""Where a kind belongs: on the floor at a wall, hung on a wall, anywhere on the floor, under the ceiling."""


@dataclass(frozen=True)
class Kind:
    name: str  # such as "fridge"
    material: str  # of ITU-R P.2040
    place: Place  # where it belongs
    make: Callable[[np.random.Generator], Trimesh]  # draws a piece, metres
    lowest: tuple[float, float] = (0.002, 0.002)  # range of the height of its lowest point above the floor, metres
    # whether a free piece stands at any angle; otherwise, like one at a wall, parallel to the walls
    turned: bool = False
    flat_metal: bool = False  # whether all its faces are of metal and parallel to the walls or the floor


def _drawn(make: Callable[..., Trimesh], *ranges: tuple[float, float]) -> Callable[[np.random.Generator], Trimesh]:
    """A shape whose lengths are drawn from ranges, metres."""
    return lambda generator: make(*(generator.uniform(*each) for each in ranges))


def _box(width: float, depth: float, height: float) -> Trimesh:
    return box((-width / 2, -depth, 0), (width / 2, 0, height))


def _board(width: float, depth: float) -> Trimesh:
    return sheet((-width / 2, -depth, 0), (width, 0, 0), (0, depth, 0))


def _upright(width: float, height: float) -> Trimesh:
    """An upright sheet, 4 cm before its back."""
    return sheet((-width / 2, -0.04, 0), (width, 0, 0), (0, 0, height))


def _tilted(generator: np.random.Generator) -> Trimesh:
    """A sheet that leans back by 20 to 70°, such as a screen or a drawing board."""
    w, h, lean = generator.uniform(0.5, 0.9), generator.uniform(0.4, 0.8), np.radians(generator.uniform(20, 70))
    return sheet((-w / 2, -h * np.sin(lean), 0), (w, 0, 0), (0, h * np.sin(lean), h * np.cos(lean)))


def _shelf(generator: np.random.Generator) -> Trimesh:
    w, d = generator.uniform(0.6, 1.3), generator.uniform(0.25, 0.4)
    heights = np.linspace(0, generator.uniform(0.9, 1.5), int(generator.integers(3, 6)))
    return union(*(sheet((-w / 2, -d, z), (w, 0, 0), (0, d, 0)) for z in heights))


def _upright_cylinder(generator: np.random.Generator) -> Trimesh:
    """A closed cylinder of 16 sides, such as a boiler or a column."""
    radius, height = generator.uniform(0.15, 0.3), generator.uniform(0.8, 1.6)
    return cylinder(radius, height, sections=16).apply_translation((0, -radius, height / 2))


def _curved_screen(generator: np.random.Generator) -> Trimesh:
    """A part of a cylinder's side, of facets 10° wide."""
    radius, height, facets = generator.uniform(0.5, 1.0), generator.uniform(0.8, 1.5), int(generator.integers(4, 9))
    angles = np.radians(10 * (np.arange(facets + 1) - facets / 2))
    x, y = radius * np.sin(angles), radius * (np.cos(angles) - 1)
    corners = np.concatenate([np.stack([x, y, np.full_like(x, z)], axis=1) for z in (0, height)])
    n = facets + 1
    faces = [f for k in range(facets) for f in ((k, k + 1, n + k + 1), (k, n + k + 1, n + k))]
    return Trimesh(corners, faces, process=False)


KINDS: tuple[Kind, ...] = (
    Kind("fridge", "metal", "wall", _drawn(_box, (0.5, 0.7), (0.5, 0.65), (0.9, 1.9)), flat_metal=True),
    Kind("locker", "metal", "wall", _drawn(_box, (0.4, 1.0), (0.35, 0.5), (1.0, 1.9)), flat_metal=True),
    Kind("wardrobe", "chipboard", "wall", _drawn(_box, (0.8, 1.4), (0.4, 0.6), (1.5, 2.1))),
    Kind("chest", "wood", "wall", _drawn(_box, (0.6, 1.1), (0.35, 0.5), (0.5, 0.9))),
    Kind("boiler", "metal", "wall", _upright_cylinder),
    Kind("column", "concrete", "free", _upright_cylinder),
    Kind("wall cupboard", "chipboard", "on the wall", _drawn(_box, (0.6, 1.2), (0.3, 0.4), (0.5, 0.8)), (1.2, 1.5)),
    Kind(
        "microwave",
        "metal",
        "on the wall",
        _drawn(_box, (0.45, 0.55), (0.3, 0.4), (0.25, 0.35)),
        (0.9, 1.5),
        flat_metal=True,
    ),
    Kind("whiteboard", "metal", "on the wall", _drawn(_upright, (0.8, 1.4), (0.6, 0.9)), (0.9, 1.2), flat_metal=True),
    Kind("radiator", "metal", "on the wall", _drawn(_upright, (0.6, 1.2), (0.4, 0.6)), (0.15, 0.2), flat_metal=True),
    Kind("mirror", "glass", "on the wall", _drawn(_upright, (0.5, 0.9), (0.8, 1.2)), (0.6, 1.0)),
    Kind("worktop", "chipboard", "wall", _drawn(_board, (0.8, 1.4), (0.5, 0.65)), (0.85, 0.9)),
    Kind("sink top", "metal", "wall", _drawn(_board, (0.6, 1.0), (0.5, 0.6)), (0.85, 0.9), flat_metal=True),
    Kind("table", "wood", "free", _drawn(_board, (0.8, 1.4), (0.6, 0.9)), (0.7, 0.76), turned=True),
    Kind("tray", "metal", "free", _drawn(_board, (0.4, 0.7), (0.3, 0.5)), (0.6, 1.0), turned=True),
    Kind("pane", "glass", "free", _drawn(_upright, (0.6, 1.0), (0.8, 1.5)), (0.002, 0.5), turned=True),
    Kind("partition", "plasterboard", "free", _drawn(_upright, (0.6, 1.1), (1.0, 1.6)), turned=True),
    Kind("screen", "metal", "free", _tilted, (0.7, 1.0), turned=True),
    Kind("curved screen", "metal", "free", _curved_screen, turned=True),
    Kind("shelf", "wood", "wall", _shelf, (0.3, 0.5)),
    Kind("steel shelf", "metal", "wall", _shelf, (0.3, 0.5), flat_metal=True),
    Kind("crate", "wood", "free", _drawn(_box, (0.4, 0.7), (0.4, 0.6), (0.4, 0.7)), turned=True),
    Kind("lamp", "metal", "ceiling", _drawn(_board, (0.6, 1.2), (0.2, 0.4)), (0.15, 0.3), flat_metal=True),
)
"""All kinds. ``lowest`` of a kind under the ceiling is its distance from it."""


def placed(mesh: Trimesh, degrees: float, place: Float[np.ndarray, " 3"]) -> Trimesh:
    """Turn a piece about the vertical line through its back's middle, and move this line's foot to a place, metres."""
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_euler("z", degrees, degrees=True).as_matrix()
    matrix[:3, 3] = place
    return mesh.copy().apply_transform(matrix)
