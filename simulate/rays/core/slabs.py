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

from scenes.checks.enclosure import WALL_REACH, beyond, in_outer_wall, outline
from scenes.checks.occupancy import holds_antennas
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
    """The slabs of an object, in the order of its triangles."""
    triangles, thickness = np.asarray(item.mesh.triangles), scene.thickness(item)
    normals, front, back = beyond(triangles, around)
    outer = np.minimum(front, back) < WALL_REACH
    away = np.where(front < back, 1.0, -1.0)  # the normal points away from the scene
    normals = np.where(outer[:, None], away[:, None] * normals, normals)
    start = np.where(outer, 0.0, -thickness / 2)
    for part, faces in zip(item.closed_parts, item.parts.members(), strict=True):
        room = holds_antennas(scene, part)  # its slab is behind the surface, that of a body under it
        normals[faces] = part.face_normals * np.sign(part.volume)
        start[faces], outer[faces] = 0.0 if room else -thickness, room
    return Slabs(_material(scene, item), triangles, normals, start, start + thickness, outer)


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
        along = (slabs.normals * item.mesh.face_normals).sum(axis=1) > 0
        reach = np.column_stack([slabs.stop, -slabs.start])
        fronts.append(np.where(along[:, None], reach, reach[:, ::-1]))
        outer.append(slabs.outer)
    return FaceSlabs(np.concatenate(fronts), np.concatenate(outer))
