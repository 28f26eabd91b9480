"""Sequences of planes that can reflect waves in turn, found by shooting rays."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int

from scenes.scene.permittivity import conducting_objects
from simulate.rays.core.ray_scene import RayScene, first_hits

PASSES = 4
"""Most objects that a ray passes through."""

NEAR = 1e-4
"""Metres behind a surface at which a ray that leaves it starts."""


def plane_sequences(
    ray_scene: RayScene,
    origins: Float[np.ndarray, "origins 3"],
    most: int,
    generator: np.random.Generator,
) -> Int[np.ndarray, "sequences most"]:
    """Sequences of planes that can reflect waves from some points, first the sequence without reflections.

    Rays are shot in random directions. A conductor reflects a ray. At other objects it is reflected or goes on.
    """
    planes, propagation = ray_scene.planes, ray_scene.propagation
    conducts = conducting_objects(ray_scene.description)[ray_scene.object_of_face]
    rays = propagation.rays
    points = origins[np.arange(rays) % len(origins)]
    directions = generator.standard_normal((rays, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    taken = np.full((rays, most), -1)
    count = np.zeros(rays, np.int64)
    found = [np.full((1, most), -1)]
    for _ in range(most + (PASSES if propagation.refraction else 0) if most else 0):
        face, distance = first_hits(ray_scene, points, directions, np.inf)
        reflected = conducts[face] | (not propagation.refraction) | (generator.random(len(face)) < 0.5)
        going = (face >= 0) & (count < most)
        points, directions, taken, count = points[going], directions[going], taken[going], count[going]
        face, distance, reflected = face[going], distance[going], reflected[going]
        points = points + distance[:, None] * directions
        plane = planes.of_face[face[reflected]]
        normals = planes.normals[plane]
        along = (directions[reflected] * normals).sum(axis=1, keepdims=True)
        directions[reflected] -= 2 * along * normals
        taken[reflected, count[reflected]] = plane
        count[reflected] += 1
        points = points + NEAR * directions
        found.append(distinct(taken[reflected], len(planes.normals)))
    return distinct(np.concatenate(found), len(planes.normals))


def distinct(sequences: Int[np.ndarray, "n most"], planes: int) -> Int[np.ndarray, "k most"]:
    """The distinct rows, in lexical order. NumPy's own function for rows is much slower."""
    key = np.zeros(len(sequences), np.int64)
    for column in sequences.T:
        key = np.unique(key * (planes + 1) + column + 1, return_inverse=True)[1].ravel()
    return sequences[np.unique(key, return_index=True)[1]]
