"""Make sheets of walls and boards that are drawn as solid bodies.

A triangle stands for a slab of its material. If the slabs of two opposite faces of a body meet, that is if they are at
most twice as far apart as their material's slab is thick, the body is solid there: a wall and not two leaves with a
gap, a table top and not a chest. Rays pass both faces and count the slab twice. A sheet with one slab as thick as the
body is right.

The sheet lies where its slab fills the body as it was drawn: in the middle, or on the inner face of an outer wall,
whose slab is behind it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import trimesh
from jaxtyping import Float
from trimesh import Trimesh

from scenes.checks.enclosure import WALL_REACH
from scenes.checks.outer_walls import beyond, outline
from scenes.importing.plates import Plate, plates
from scenes.scene.closed_parts import merge_corners
from scenes.scene.description import LONGEST_NAME, Scene, SceneObject
from scenes.scene.permittivity import is_conductor

SOLID = 2.0
"""Thicknesses of the material's slab up to which a body is solid."""

DRAWN_THIN = 0.4
"""Thicknesses of the material's slab. A thinner body is drawn so only to have two sides, and keeps the material's."""

LEAST_TRIANGLES = 8
"""Triangles of a box without its ends."""


def walls_as_sheets(scene: Scene) -> tuple[Scene, dict[str, float]]:
    """Make each plate of a dielectric one sheet, if it is at most twice as thick as its material's slab.

    An object keeps its name. If its plates have several thicknesses, or it has other parts, the sheets of each
    thickness become an object of their own, such as "walls, 0.12 m thick".
    """
    divided = {item.name: _divided(scene, item) for item in scene.objects}
    placed = _placed(scene, divided)
    names = {item.name for item in scene.objects}
    objects: list[SceneObject] = []
    sheets: dict[str, float] = {}
    for item in scene.objects:
        found, rest = divided[item.name]
        groups: dict[float, list[Float[np.ndarray, "k 3 3"]]] = {}
        for plate, sheet in zip(found, placed[item.name], strict=True):
            slab = scene.thickness(item)
            thickness = plate.thickness if plate.thickness >= DRAWN_THIN * slab else slab
            groups.setdefault(thickness, []).append(sheet)
        if len(rest):
            objects.append(replace(item, mesh=_mesh(rest)) if groups else item)
        for thickness, parts in groups.items():
            name = item.name
            if len(rest) or len(groups) > 1:
                name = _new_name(f"{item.name[: LONGEST_NAME - 30]}, {thickness:g} m thick", names)
            sheets[name] = thickness
            objects.append(SceneObject(name, _mesh(np.concatenate(parts)), item.material, thickness))
    return replace(scene, objects=tuple(objects)), sheets


def _divided(scene: Scene, item: SceneObject) -> tuple[list[Plate], Float[np.ndarray, "n 3 3"]]:
    """The plates of an object that count twice, and its other triangles, metres.

    A conductor reflects at its surface, so its plates are right as they are.
    """
    found: list[Plate] = []
    if is_conductor(scene.materials[item.material], scene.frequency) or len(item.mesh.faces) < LEAST_TRIANGLES:
        return found, item.mesh.triangles
    rest = [np.zeros((0, 3, 3))]
    for body in _bodies(item):
        of_body = plates(body, SOLID * scene.thickness(item)) if len(body.faces) >= LEAST_TRIANGLES else []
        found += of_body
        rest += [] if of_body else [body.triangles]
    return found, np.concatenate(rest) if found else item.mesh.triangles


def _bodies(item: SceneObject) -> list[Trimesh]:
    """The connected parts of an object, wound consistently."""
    closed = item.closed_parts
    if sum(len(part.faces) for part in closed) == len(item.mesh.faces):
        return closed
    parts = merge_corners(item.mesh).split(only_watertight=False, repair=False)
    others = [part for part in parts if not part.is_watertight]
    for part in others:
        trimesh.repair.fix_winding(part)
    return [*closed, *others]


def _placed(
    scene: Scene, divided: dict[str, tuple[list[Plate], Float[np.ndarray, "n 3 3"]]]
) -> dict[str, list[Float[np.ndarray, "k 3 3"]]]:
    """Move the sheets of outer walls from the middle to the inner face. Outer walls are found among the sheets."""
    every = [plate for found, _ in divided.values() for plate in found]
    if not every:
        return {name: [] for name in divided}
    objects = []
    for item in scene.objects:
        found, rest = divided[item.name]
        mesh = _mesh(np.concatenate([rest, *(plate.sheet for plate in found)])) if found else item.mesh
        objects.append(replace(item, mesh=mesh))
    around = outline(replace(scene, objects=tuple(objects)))
    normals, front, back = beyond(np.stack([plate.sheet[0] for plate in every]), around)
    half = np.array([plate.thickness / 2 for plate in every])
    inward = np.where(front > back, half, -half)
    moved = np.where(np.minimum(front, back) + half < WALL_REACH, inward, 0.0)
    sheets = iter([plate.sheet + move * normal for plate, move, normal in zip(every, moved, normals, strict=True)])
    return {name: [next(sheets) for _ in found] for name, (found, _) in divided.items()}


def _mesh(triangles: Float[np.ndarray, "n 3 3"]) -> Trimesh:
    mesh = Trimesh(triangles.reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3), process=False)
    mesh.merge_vertices()
    return mesh


def _new_name(name: str, taken: set[str]) -> str:
    unique, count = name, 1
    while unique in taken:
        count += 1
        unique = f"{name} {count}"
    taken.add(unique)
    return unique
