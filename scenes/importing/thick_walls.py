"""Find walls and boards that are drawn as closed boxes, and make each of them one sheet.

A triangle stands for a slab of its material. If the slabs of a body's two broad faces meet, that is if the body is at
most twice as thick as its material's slab, the body is solid: a wall and not two leaves with a gap, a table top and not
a chest. Rays pass both faces and count its slab twice. A sheet with one slab as thick as the body is right.

The sheet lies where its slab fills the body as it was drawn: in the middle, or on the inner face of an outer wall,
whose slab is behind it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import trimesh
from jaxtyping import Float, Int
from trimesh import Trimesh

from scenes.checks.enclosure import WALL_REACH
from scenes.checks.outer_walls import scene_beyond
from scenes.scene.closed_parts import merge_corners
from scenes.scene.description import LONGEST_NAME, Scene, SceneObject
from scenes.scene.permittivity import is_conductor

SOLID = 2.0
"""Thicknesses of the material's slab up to which a body is solid."""

DRAWN_THIN = 0.4
"""Thicknesses of the material's slab. A thinner body is drawn so only to have two sides, and keeps the material's."""

WIDE = 2.0
"""Thicknesses of a plate that it is wide at least. Columns and beams are narrower and stay as they are drawn."""

PARALLEL = np.cos(np.radians(1.0))
"""Cosine of the largest angle between a plate's normal and those of its broad faces."""

STEEP = np.cos(np.radians(40.0))
"""Largest cosine between a plate's normal and that of its rim. A rim may be mitred at 45°."""

UNEVEN = 0.02
"""Largest deviation of a broad face from its plane, as a share of the plate's thickness."""


@dataclass(frozen=True)
class Plate:
    """A body with two parallel broad faces.

    Attributes:
        faces: its triangles, as indices into the faces of the mesh.
        sheet: the triangles of its larger broad face, moved to the middle, metres.
        thickness: distance of the broad faces, metres.
    """

    faces: Int[np.ndarray, " f"]
    sheet: Float[np.ndarray, "k 3 3"]
    thickness: float


def plates(mesh: Trimesh, thickest: float) -> list[Plate]:
    """Find the plates in a mesh. They may be turned, have openings, and lack parts of their rims.

    Args:
        mesh: the mesh, metres.
        thickest: largest thickness, metres.

    >>> from scenes.scene.shapes import box
    >>> [round(plate.thickness, 3) for plate in plates(box((0, 0, 0), (4, 0.2, 3)), thickest=0.4)]
    [0.2]
    >>> plates(box((0, 0, 0), (0.3, 0.3, 3)), thickest=0.4)  # a column
    []
    """
    connected = merge_corners(mesh)
    body = trimesh.graph.connected_component_labels(connected.face_adjacency, node_count=len(mesh.faces))
    order = np.argsort(body, kind="stable")
    found = []
    for faces in np.split(order, np.flatnonzero(np.diff(body[order])) + 1):
        if len(faces) >= 8:  # two faces and four sides of a box without its ends
            plate = _plate(faces, mesh.triangles[faces], thickest)
            found += [plate] if plate is not None else []
    return found


def _plate(faces: Int[np.ndarray, " f"], triangles: Float[np.ndarray, "f 3 3"], thickest: float) -> Plate | None:
    cross = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    areas = np.linalg.norm(cross, axis=1) / 2
    normals = cross / (2 * areas)[:, None].clip(1e-30)
    # The broad faces dominate the second moment of the normals. The nearest normal of a large face is the exact one.
    _, axes = np.linalg.eigh((areas[:, None] * normals).T @ normals)
    normal = normals[np.argmax(areas * (np.abs(normals @ axes[:, -1]) > PARALLEL))]
    tilt = np.abs(normals @ normal)
    broad = tilt > PARALLEL
    heights = triangles @ normal
    low, high = heights.min(), heights.max()
    thickness = float(high - low)
    lower = broad & (heights.max(axis=1) - low < UNEVEN * thickness)
    upper = broad & (high - heights.min(axis=1) < UNEVEN * thickness)
    sides = [areas[lower].sum(), areas[upper].sum()]
    if not 0 < thickness <= thickest or np.any(broad & ~lower & ~upper) or np.any(tilt[~broad] > STEEP):
        return None
    if min(sides) < 0.5 * max(sides):
        return None
    centres = [np.average(triangles[side].mean(axis=1), axis=0, weights=areas[side]) for side in (lower, upper)]
    apart = np.linalg.norm(np.cross(centres[1] - centres[0], normal))
    border = areas[~broad].sum() / thickness
    if apart > thickness or 2 * max(sides) < WIDE * thickness * border:  # twice the area over the border: the width
        return None
    larger = lower if sides[0] >= sides[1] else upper
    away = (low + high) / 2 - heights[larger]
    return Plate(faces, triangles[larger] + away[..., None] * normal, thickness)


def walls_as_sheets(scene: Scene) -> tuple[Scene, dict[str, float]]:
    """Make each plate of a dielectric one sheet, if it is at most twice as thick as its material's slab.

    An object keeps its name. If its plates have several thicknesses, or it has other parts, the sheets of each
    thickness become an object of their own, such as "walls, 0.12 m thick".

    Args:
        scene: the scene, with walls as they are drawn.

    Returns:
        The scene with sheets, and the thickness of the slab in metres of each object made of sheets, by name.
    """
    found = {item.name: plates_of(scene, item) for item in scene.objects}
    if not any(found.values()):
        return scene, {}
    placed = _placed(scene, found)
    names = {item.name for item in scene.objects}
    objects: list[SceneObject] = []
    sheets: dict[str, float] = {}
    for item in scene.objects:
        groups: dict[float, list[Float[np.ndarray, "k 3 3"]]] = {}
        for plate, sheet in zip(found[item.name], placed[item.name], strict=True):
            slab = scene.thickness(item)
            thickness = round(plate.thickness, 4) if plate.thickness >= DRAWN_THIN * slab else slab
            groups.setdefault(thickness, []).append(sheet)
        rest = _without(item.mesh, found[item.name])
        if len(rest.faces):
            objects.append(replace(item, mesh=rest) if groups else item)
        for thickness, parts in groups.items():
            name = item.name
            if len(rest.faces) or len(groups) > 1:
                name = _new_name(f"{item.name[: LONGEST_NAME - 30]}, {thickness:g} m thick", names)
            sheets[name] = thickness
            objects.append(SceneObject(name, _mesh(np.concatenate(parts)), item.material, thickness))
    return replace(scene, objects=tuple(objects)), sheets


def plates_of(scene: Scene, item: SceneObject) -> list[Plate]:
    """Find the plates of an object that count twice, because the slabs of their two faces meet.

    A conductor reflects at its surface, so its plates are right as they are.

    Args:
        scene: the scene.
        item: one of its objects.
    """
    if is_conductor(scene.materials[item.material], scene.frequency):
        return []
    return plates(item.mesh, SOLID * scene.thickness(item) * (1 + UNEVEN))


def _placed(scene: Scene, found: dict[str, list[Plate]]) -> dict[str, list[Float[np.ndarray, "k 3 3"]]]:
    """Move the sheets of outer walls from the middle to the inner face. Outer walls are found among the sheets."""
    items = (replace(item, mesh=_in_the_middle(item.mesh, found[item.name])) for item in scene.objects)
    every = [plate for of_item in found.values() for plate in of_item]
    normals, front, back = scene_beyond(
        replace(scene, objects=tuple(items)), np.stack([plate.sheet[0] for plate in every])
    )
    half = np.array([plate.thickness / 2 for plate in every])
    inward = np.where(front > back, half, -half)
    moved = np.where(np.minimum(front, back) + half < WALL_REACH, inward, 0.0)
    sheets = iter([plate.sheet + move * normal for plate, move, normal in zip(every, moved, normals, strict=True)])
    return {name: [next(sheets) for _ in of_item] for name, of_item in found.items()}


def _without(mesh: Trimesh, found: list[Plate]) -> Trimesh:
    rest = np.ones(len(mesh.faces), dtype=bool)
    for plate in found:
        rest[plate.faces] = False
    return mesh if rest.all() else _mesh(mesh.triangles[rest])


def _in_the_middle(mesh: Trimesh, found: list[Plate]) -> Trimesh:
    if not found:
        return mesh
    return _mesh(np.concatenate([_without(mesh, found).triangles, *(plate.sheet for plate in found)]))


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
