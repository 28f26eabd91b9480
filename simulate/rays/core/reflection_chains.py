"""Chains of reflections: found once by shooting rays, then solved exactly for every element and transmitter.

A chain is the sequence of planes that reflect a wave. The gateway never moves, and only some hundreds of chains in a
room carry power. Rays that are shot anew for every transmitter find the same chains again and again, and miss some each
time. Here rays are shot once, from the elements and from positions in the region, and the chains that they find are
collected. Then the image method solves each chain for every element and transmitter.

Every path counts once, since two triangles of one wall lie in the same plane. Objects that a path passes through are
not part of its chain. They are found when the path is solved.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np
from jaxtyping import Float, Int

from simulate.rays.core.electric_field import Ways, solved
from simulate.rays.core.image_method import Images, batches, on_device, pieces
from simulate.rays.core.multipath import STRAIGHT, Interaction
from simulate.rays.core.propagation import Propagation
from simulate.rays.core.ray_scene import RayScene
from simulate.rays.core.ray_tracer import mi
from simulate.rays.core.shooting import reversed_sequences
from simulate.rays.core.sionna_scene import Antennas
from simulate.rays.core.solution import Course, Solution, largest_shares
from simulate.rays.core.surfaces import Surfaces

Chains = Int[np.ndarray, "chains depth"]
"""Planes that reflect the wave, from source to target; −1 after the last one."""

NEGLIGIBLE = 1e-6
"""A chain is dropped if its share of the power is smaller than this at every trial and every element."""


def line_of_sight(propagation: Propagation) -> Chains:
    """The chain without reflections if the line of sight is followed, otherwise no chain."""
    return np.full((int(propagation.los), propagation.max_depth), -1)


def find_chains(
    ray_scene: RayScene,
    elements: Antennas,
    trials: Antennas,
    forth: Chains,
    back: Chains,
    surfaces: Surfaces,
    report: Callable[[str], None],
) -> Chains:
    """The chains that carry power from the gateway to some position, of those that rays from both ends found."""
    propagation = ray_scene.propagation
    if not propagation.specular or not propagation.max_depth:
        return line_of_sight(propagation)
    chains = np.unique(np.concatenate([forth, reversed_sequences(back)]), axis=0)
    chains = chains if propagation.los else chains[1:]
    solutions = reflected(ray_scene, chains, elements, trials, [surfaces])
    kept = largest_shares(solutions, len(chains), np.zeros((len(trials), len(elements)))) >= NEGLIGIBLE
    kept[: int(propagation.los)] = True
    report(f"{kept.sum()} chains of reflections, of {len(chains):,} tried")
    return chains[kept]


def reflected(
    ray_scene: RayScene, chains: Chains, sources: Antennas, targets: Antennas, surfaces: Sequence[Surfaces]
) -> Iterator[Solution]:
    """Solve every chain exactly between every source and target.

    The paths are ordered by the number of reflections, then by target, chain and source.
    """
    counts = (chains >= 0).sum(axis=1)
    wavelengths = [each.wavelength for each in surfaces]
    for count in np.unique(counts):
        number = np.flatnonzero(counts == count)
        images = Images(ray_scene.mirrors, chains[number, :count], sources.positions)
        for start, stop in batches(len(targets), len(number), len(sources)):
            some = targets.subset(slice(start, stop))
            places = on_device(some.positions)
            possible = images.possible(places, len(some))
            for paths in pieces(possible):
                combination = images.combination(paths)
                vertices, faces, length = images.ways(places, combination)
                points = [mi.Point3f(vertex) for vertex in vertices]
                ways = Ways(combination.source, combination.target, points, faces, length, 1 / length)
                amplitudes = solved(surfaces, sources, some, ways)
                target, chain, source = (each.numpy().astype(np.int64) for each in combination)
                antennas = sources.positions[source], some.positions[target]
                course = partial(_course, ways, *antennas, ray_scene, chains.shape[1])
                yield Solution(number[chain], start + target, source, length, amplitudes, wavelengths, course)


def _course(
    ways: Ways,
    starts: Float[np.ndarray, "paths 3"],
    ends: Float[np.ndarray, "paths 3"],
    ray_scene: RayScene,
    depth: int,
) -> Course:
    """Where paths with some number of reflections run, with places for ``depth`` of them."""
    count, shape = len(ways.faces), (len(starts), depth)
    objects, kinds = np.full(shape, STRAIGHT), np.full(shape, int(Interaction.NONE))
    kinds[:, :count] = Interaction.REFLECTION
    vertices = np.concatenate([starts[:, None], *[ends[:, None]] * (depth + 1)], axis=1)
    for number, (vertex, face) in enumerate(zip(ways.vertices, ways.faces, strict=True)):
        vertices[:, 1 + number], objects[:, number] = vertex.numpy().T, ray_scene.object_of_face[face.numpy()]
    return vertices, objects, kinds
