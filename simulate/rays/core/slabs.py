"""The slabs of dielectric that a scene's surfaces stand for, and its conducting sheets.

A scene's surfaces have no thickness. The slab that a surface stands for lies

- behind an outer wall, which has everything else, antennas included, on its other side;
- inside a closed body, under its surface, unless the body is a room drawn as a box, with the gateway and the region in
  it;
- half on either side of any other sheet.

A conductor reflects at its surface, whatever its thickness. So it is a sheet of no thickness at the surface.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy.spatial import cKDTree
from trimesh import Trimesh

from scenes.checks.enclosure import beyond, in_outer_wall, outline
from scenes.checks.occupancy import holds_antennas
from scenes.scene.closed_parts import merge_corners
from scenes.scene.description import Scene, SceneObject
from scenes.scene.materials import RadioMaterial, is_conductor


@dataclass(frozen=True)
class Slabs:
    """Triangles of one dielectric, and the place of the slab at each of them."""

    material: RadioMaterial  # the dielectric
    triangles: Float[np.ndarray, "n 3 3"]  # corners of the triangles, metres, world frame
    normals: Float[np.ndarray, "n 3"]  # unit normals of the triangles
    start: Float[np.ndarray, " n"]  # where the slab begins along the normal, metres from the triangle
    stop: Float[np.ndarray, " n"]  # where the slab ends along the normal, metres from the triangle
    # whether the slab is that of an outer wall, which continues around the corners of the scene
    outer: Bool[np.ndarray, " n"]


def conducting_triangles(scene: Scene) -> Float[np.ndarray, "n 3 3"]:
    """Corners of the triangles of all conductors, metres, world frame."""
    found = [item.mesh.triangles for item in scene.objects if is_conductor(_material(scene, item), scene.frequency)]
    return np.concatenate(found) if found else np.zeros((0, 3, 3))


def dielectric_slabs(scene: Scene) -> list[Slabs]:
    """The slabs of all objects that are not conductors."""
    around = outline(scene)
    return [
        _slabs_of(scene, item, around)
        for item in scene.objects
        if not is_conductor(_material(scene, item), scene.frequency)
    ]


def _material(scene: Scene, item: SceneObject) -> RadioMaterial:
    return scene.materials[item.material]


def _slabs_of(scene: Scene, item: SceneObject, around: Float[np.ndarray, "n 3"]) -> Slabs:
    material = _material(scene, item)
    thickness = scene.thickness(item)
    closed = item.closed_parts
    pieces = [_of_closed_part(scene, part, thickness) for part in closed]
    if sum(len(part.faces) for part in closed) < len(item.mesh.faces):
        parts = merge_corners(item.mesh).split(only_watertight=False, repair=False)  # repair would close open boxes
        open_parts = [part for part in parts if not part.is_watertight]
        pieces += [_of_sheet(part.triangles, thickness, around) for part in open_parts]
    triangles, normals, start, stop, outer = (np.concatenate(values) for values in zip(*pieces, strict=True))
    return Slabs(material, triangles, normals, start, stop, outer)


def _of_closed_part(scene: Scene, part: Trimesh, thickness: float) -> tuple[np.ndarray, ...]:
    """The slab under the surface of a body, or behind the surface of a room."""
    room = holds_antennas(scene, part)
    normals = part.face_normals * np.sign(part.volume)
    zero, full = np.zeros(len(normals)), np.full(len(normals), thickness)
    inside, outside = (-full, zero), (zero, full)
    start, stop = outside if room else inside
    return part.triangles, normals, start, stop, np.full(len(normals), room)


def _of_sheet(
    triangles: Float[np.ndarray, "n 3 3"], thickness: float, around: Float[np.ndarray, "points 3"]
) -> tuple[np.ndarray, ...]:
    """The slab behind the sheet of an outer wall, or on both sides of another sheet."""
    normals, front, back = beyond(triangles, around)
    outer = in_outer_wall(triangles, around)
    away = np.where(front < back, 1.0, -1.0)  # the normal points away from the scene
    normals = np.where(outer[:, None], away[:, None] * normals, normals)
    start = np.where(outer, 0.0, -thickness / 2)
    return triangles, normals, start, start + thickness, outer


@dataclass(frozen=True)
class FaceSlabs:
    """The slab of every triangle of a scene, counted through its objects."""

    # how far the slab reaches in the direction of the mesh's normal, and in the opposite one, metres; 0 for
    # conductors
    fronts: Float[np.ndarray, "faces 2"]
    outer: Bool[np.ndarray, " faces"]  # whether the slab is that of an outer wall


def face_slabs(scene: Scene) -> FaceSlabs:
    """The slab of every triangle of a scene."""
    fronts, outer, around = [], [], outline(scene)
    for item in scene.objects:
        if is_conductor(_material(scene, item), scene.frequency):
            fronts.append(np.zeros((len(item.mesh.faces), 2)))
            outer.append(in_outer_wall(item.mesh.triangles, around))
            continue
        slabs = _slabs_of(scene, item, around)
        _, which = cKDTree(slabs.triangles.mean(axis=1)).query(item.mesh.triangles_center)
        along = (slabs.normals[which] * item.mesh.face_normals).sum(axis=1) > 0
        reach = np.column_stack([slabs.stop[which], -slabs.start[which]])
        fronts.append(np.where(along[:, None], reach, reach[:, ::-1]))
        outer.append(slabs.outer[which])
    return FaceSlabs(np.concatenate(fronts), np.concatenate(outer))
