"""A scene in the ray tracer's form, with the propagation to follow. Every step of the tracing needs both.

Rays are traced in single precision, which rounds a coordinate of 100 km to 8 mm. So the tracer counts coordinates from
a point near the antennas. ``Tracer`` converts positions on their way in and out. In the files of its two solvers, and
in all files of ``core``, ``diffraction`` and ``scattering``, "world frame" stands for the axes of the world with this
point as the origin.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

from scenes.scene.description import Scene
from scenes.scene.shapes import bounding_box
from scenes.scene.shifted import shifted
from simulate.rays.core.planes import Planes
from simulate.rays.core.propagation import Propagation
from simulate.rays.core.ray_tracer import dr, mi, rt
from simulate.rays.core.sionna_scene import build_scene, sionna_names
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
        return np.array([int(self.sionna.objects[name].object_id) for name in sionna_names(self.description)])

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
    shape = mi.UInt(dr.reinterpret_array(mi.UInt, hit.shape)).numpy()
    face = ray_scene.planes.first_face[shape] + hit.prim_index.numpy()
    return np.where(hit.is_valid().numpy(), face, -1), hit.t.numpy()
