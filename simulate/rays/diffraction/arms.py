"""Arms: the ways from an antenna to an edge, straight or with reflections."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from scenes.scene.permittivity import conducting_objects
from simulate.rays.core.ray_scene import RayScene, first_hits


@dataclass(frozen=True)
class Arms:
    """Sequences of reflections between an antenna and an edge.

    Attributes:
        planes: planes of the reflections, from the antenna on; −1 after the last one.
        edges: index of each arm's edge.
    """

    planes: Int[np.ndarray, "arms most"]
    edges: Int[np.ndarray, " arms"]

    def __len__(self) -> int:
        return len(self.edges)

    def subset(self, index: Int[np.ndarray, " k"] | Bool[np.ndarray, " arms"]) -> Arms:
        """The arms with these indices, or those that a mask selects."""
        return Arms(self.planes[index], self.edges[index])

    @property
    def reflections(self) -> Int[np.ndarray, " arms"]:
        """Number of reflections of each arm."""
        return (self.planes >= 0).sum(axis=1)


PASSES = 2
"""Most objects that a ray passes through."""

NEAR = 1e-4
"""Metres behind a surface at which a ray that leaves it starts."""


def reflection_sequences(
    ray_scene: RayScene,
    origins: Float[np.ndarray, "origins 3"],
    most: int,
    rays: int,
    generator: np.random.Generator,
) -> Int[np.ndarray, "sequences most"]:
    """Sequences of planes that can reflect waves from some points, first the sequence without reflections.

    Rays are shot in random directions. A conductor reflects a ray. At other objects it is reflected or goes on.

    Args:
        ray_scene: the scene.
        origins: where the rays begin, metres.
        most: largest number of reflections.
        rays: number of rays.
        generator: draws the directions.

    Returns:
        Planes in the order of the reflections, −1 after the last one; the sequences are in lexical order.
    """
    planes = ray_scene.planes
    conducts = conducting_objects(ray_scene.description)[ray_scene.object_of_face]
    points = origins[np.arange(rays) % len(origins)]
    directions = generator.standard_normal((rays, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    taken = np.full((rays, most), -1)
    count = np.zeros(rays, np.int64)
    found = [np.full((1, most), -1)]
    for _ in range(most + PASSES if most else 0):
        face, distance = first_hits(ray_scene, points, directions, np.inf)
        going = (face >= 0) & (count < most)
        points, directions, taken, count = points[going], directions[going], taken[going], count[going]
        face, distance = face[going], distance[going]
        points = points + distance[:, None] * directions
        reflected = conducts[face] | (generator.random(len(face)) < 0.5)
        plane = planes.of_face[face[reflected]]
        normals = planes.normals[plane]
        along = (directions[reflected] * normals).sum(axis=1, keepdims=True)
        directions[reflected] -= 2 * along * normals
        taken[reflected, count[reflected]] = plane
        count[reflected] += 1
        points = points + NEAR * directions
        found.append(np.unique(taken[reflected], axis=0))
    return np.unique(np.concatenate(found), axis=0)
