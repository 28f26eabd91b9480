"""A scene in the ray tracer's form, with the propagation to follow. Every step of the tracing needs both.

Rays are traced in single precision, which rounds a coordinate of 100 km to 8 mm. So the tracer counts coordinates from
a point near the antennas. ``Tracer`` converts positions on their way in and out. In all other
files of ``rays``, "world frame" stands for the axes of the world with this point as the origin.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

from scenes.scene.description import Scene, shifted
from scenes.scene.shapes import bounding_box
from simulate.rays.core.multipath import STRAIGHT, Interaction, Multipath
from simulate.rays.core.planes import Planes
from simulate.rays.core.propagation import MOST_PASSES, Propagation
from simulate.rays.core.ray_tracer import dr, mi, rt
from simulate.rays.core.sionna_scene import build_scene
from simulate.rays.core.slabs import FaceSlabs, face_slabs


@dataclass(frozen=True)
class RayScene:
    """A scene, the same scene in Sionna RT, and the propagation to follow in it."""

    description: Scene  # the scene as the user described it, in coordinates from ``origin``
    sionna: rt.Scene  # its objects and radio materials in Sionna RT
    propagation: Propagation  # the mechanisms to follow, and how far
    origin: Float[np.ndarray, " 3"]  # where the coordinates are counted from, metres, in the user's own coordinates

    @classmethod
    def of(cls, scene: Scene, propagation: Propagation) -> RayScene:
        """Build a scene in Sionna RT."""
        origin = _origin(scene)
        near = shifted(scene, -origin) if origin.any() else scene
        return cls(near, build_scene(near), propagation, origin)

    @cached_property
    def identifiers(self) -> Int[np.ndarray, " objects"]:
        """Sionna RT's identifier of each object of the description, in the description's order."""
        every = self.sionna.objects
        return np.array([int(every[f"object-{number}"].object_id) for number in range(len(every))])

    @cached_property
    def object_of_identifier(self) -> Int[np.ndarray, " identifiers"]:
        """Index of the object that each of Sionna RT's identifiers stands for."""
        index = np.zeros(self.identifiers.max() + 1, dtype=np.int64)
        index[self.identifiers] = np.arange(len(self.identifiers))
        return index

    @cached_property
    def object_of_face(self) -> Int[np.ndarray, " faces"]:
        """Index of each triangle's object. The triangles are numbered through all objects of the description."""
        return np.repeat(
            np.arange(len(self.description.objects)), [len(item.mesh.faces) for item in self.description.objects]
        )

    @cached_property
    def normals(self) -> Float[np.ndarray, "faces 3"]:
        """Unit normal of each triangle, as in the object's mesh."""
        return np.concatenate([item.mesh.face_normals for item in self.description.objects])

    @cached_property
    def slabs(self) -> FaceSlabs:
        """The slab of each triangle."""
        return face_slabs(self.description)

    @cached_property
    def planes(self) -> Planes:
        """The planes that the objects' triangles lie in."""
        return Planes(self.description, self.identifiers.tolist())


NEAR = 1e-4
"""Metres from a vertex within which a surface does not block a path, since it is the surface of the vertex."""

ORIGINS = 100.0
"""Metres. The coordinates of an origin are multiples of this, so that a scene near the user's own origin stays as it
is. Within half of it, single precision rounds to 2 µm."""


def _origin(scene: Scene) -> Float[np.ndarray, " 3"]:
    """The origin nearest the middle of the antennas, metres, in the user's coordinates."""
    antennas = bounding_box(np.vstack([scene.transmitter.region, scene.gateway.position]))
    return ORIGINS * np.round(antennas.mean(axis=0) / ORIGINS)


def first_hits(
    ray_scene: RayScene, starts: Float[np.ndarray, "n 3"], steps: Float[np.ndarray, "n 3"], reach: float
) -> tuple[Int[np.ndarray, " n"], Float[np.ndarray, " n"]]:
    """The first triangle that each straight line meets."""
    if not len(starts):  # the ray tracer would abort the process
        return np.zeros(0, np.int64), np.zeros(0)
    points, directions = (np.array(each.T, np.float32, order="C") for each in (starts, steps))
    lines = mi.Ray3f(mi.Point3f(points), mi.Vector3f(directions))
    lines.maxt = mi.Float(reach)  # type: ignore[assignment]
    hit = ray_scene.sionna.mi_scene.ray_intersect_preliminary(lines)
    dr.eval(hit)  # otherwise the lines are traced for each of the arrays below
    shape = mi.UInt(dr.reinterpret_array(mi.UInt, hit.shape)).numpy()
    face = ray_scene.planes.first_face[shape] + hit.prim_index.numpy()
    return np.where(hit.is_valid().numpy(), face, -1), hit.t.numpy()


def with_transmissions(ray_scene: RayScene, found: Multipath) -> Multipath:
    """Paths with a vertex wherever they pass through an object."""
    count, columns = found.kinds.shape
    # The place of a vertex along its path is its number. That of a passage is the number of the vertex before it plus
    # the share of the way to the next vertex.
    paths, places = [np.repeat(np.arange(count), columns)], [np.tile(np.arange(1.0, columns + 1), count)]
    points, objects, kinds = [found.vertices[:, 1:-1].reshape(-1, 3)], [found.objects.ravel()], [found.kinds.ravel()]
    for number in range(columns + 1):
        start, step = found.vertices[:, number], found.vertices[:, number + 1] - found.vertices[:, number]
        length = np.linalg.norm(step, axis=1)
        active, travelled = np.flatnonzero(length > 2 * NEAR), np.full(count, NEAR)
        for _ in range(MOST_PASSES):
            unit = step[active] / length[active, None]
            left = length[active] - NEAR - travelled[active]
            face, share = first_hits(
                ray_scene, start[active] + travelled[active, None] * unit, left[:, None] * unit, 1.0
            )
            hit = (face >= 0) & (left > 0)
            active, unit = active[hit], unit[hit]
            travelled[active] += (left * share)[hit]
            paths.append(active)
            places.append(number + travelled[active] / length[active])
            points.append(start[active] + travelled[active, None] * unit)
            objects.append(np.full(len(active), STRAIGHT))
            kinds.append(np.full(len(active), int(Interaction.TRANSMISSION)))
            travelled[active] += NEAR
    path, kind = np.concatenate(paths), np.concatenate(kinds)
    happened = kind != Interaction.NONE
    order = np.flatnonzero(happened)[np.lexsort((np.concatenate(places)[happened], path[happened]))]
    number_of = np.bincount(path[order], minlength=count)
    column = np.arange(len(order)) - np.repeat(np.cumsum(number_of) - number_of, number_of)
    most = max(1, int(number_of.max(initial=0)))
    vertices = np.repeat(found.vertices[:, -1:], most + 2, axis=1)
    vertices[:, 0] = found.vertices[:, 0]
    vertices[path[order], 1 + column] = np.concatenate(points)[order]
    new_objects, new_kinds = np.full((count, most), STRAIGHT), np.full((count, most), int(Interaction.NONE))
    new_objects[path[order], column], new_kinds[path[order], column] = np.concatenate(objects)[order], kind[order]
    return found._replace(vertices=vertices, objects=new_objects, kinds=new_kinds)
