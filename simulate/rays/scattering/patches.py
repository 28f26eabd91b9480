"""The patches of a scene's rough surfaces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh
from jaxtyping import Float, Int

from scenes.scene.shapes import union
from simulate.rays.core.ray_scene import RayScene


@dataclass(frozen=True)
class Patches:
    """Pieces of rough surfaces, all of one area."""

    points: Float[np.ndarray, "patches 3"]  # middle of each patch, metres, world frame
    faces: Int[np.ndarray, " patches"]  # number of each patch's triangle, counted through the scene's objects
    phases: Float[np.ndarray, " patches"]  # phase by which each patch delays the waves that it scatters, radians
    area: float  # area of each patch, m²

    def __len__(self) -> int:
        return len(self.points)


def patches_of(ray_scene: RayScene, count: int, seed: int) -> Patches:
    """Draw patches at random, uniformly by area, on the objects whose material has a scattering coefficient.

    The roughness of a surface is unknown, so the phase of each patch is drawn at random from 0 to 2π.
    """
    scene = ray_scene.description
    rough = np.array([scene.materials[item.material].scattering_coefficient > 0 for item in scene.objects])
    chosen = np.nonzero(rough[ray_scene.object_of_face])[0]
    if not len(chosen):
        return Patches(np.zeros((0, 3)), np.zeros(0, np.int64), np.zeros(0), 0.0)
    mesh = union(*(item.mesh for item in scene.objects))
    mesh.update_faces(chosen)
    points, face = trimesh.sample.sample_surface(mesh, count, seed=seed)
    phases = np.random.default_rng([seed, 1]).uniform(0, 2 * np.pi, count)
    return Patches(np.asarray(points), chosen[face], phases, float(mesh.area) / count)
