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

from scenes.scene.description import conducting_objects
from simulate.positions.placement import free_positions
from simulate.rays.core.electric_field import Ways, path_amplitudes
from simulate.rays.core.image_method import Images
from simulate.rays.core.multipath import STRAIGHT, Course, Interaction, Solution, largest_shares
from simulate.rays.core.propagation import Propagation
from simulate.rays.core.ray_scene import RayScene, first_hits
from simulate.rays.core.sionna_scene import Antennas, gateway_antennas, transmitter_antennas
from simulate.rays.core.surfaces import Surfaces

Chains = Int[np.ndarray, "chains depth"]
"""Planes that reflect the wave, from source to target; −1 after the last one."""

TRIALS = 200
"""Number of positions at which a chain is tried, from every element. The number is large, since some chains carry power
only within centimetres of one place in the region, or only to one column of the array."""

NEGLIGIBLE = 1e-6
"""A chain is dropped if its share of the power is smaller than this at every trial and every element."""

LANES = 400_000  # Paths solved at a time. This bounds the memory at some 200 MB.


def line_of_sight(propagation: Propagation) -> Chains:
    """The chain without reflections if the line of sight is followed, otherwise no chain."""
    return np.full((int(propagation.los), propagation.max_depth), -1)


def find_chains(
    ray_scene: RayScene, region: Float[np.ndarray, "2 3"], seed: int, report: Callable[[str], None]
) -> Chains:
    """Find the chains that carry power from the gateway to anywhere in a region."""
    scene, propagation = ray_scene.description, ray_scene.propagation
    if not propagation.specular or not propagation.max_depth:
        return line_of_sight(propagation)
    generator = np.random.default_rng(seed)
    elements = gateway_antennas(scene)
    trials = transmitter_antennas(scene, free_positions(scene, region, TRIALS, generator))
    forth, back = (
        plane_sequences(ray_scene, antennas.positions, propagation.max_depth, generator)
        for antennas in (elements, trials)
    )
    chains = distinct(np.concatenate([forth, reversed_chains(back)]), len(ray_scene.planes.normals))
    chains = chains if propagation.los else chains[1:]
    solutions = reflected(ray_scene, chains, elements, trials, [Surfaces(ray_scene)])
    kept = largest_shares(solutions, len(chains), np.zeros((len(trials), len(elements)))) >= NEGLIGIBLE
    kept[: int(propagation.los)] = True
    report(f"{kept.sum()} chains of reflections, of {len(chains):,} tried")
    return chains[kept]


def reversed_chains(chains: Chains) -> Chains:
    """The chains from target to source."""
    count = (chains >= 0).sum(axis=1, keepdims=True)
    place = count - 1 - np.arange(chains.shape[1])
    return np.where(place >= 0, np.take_along_axis(chains, place.clip(0), axis=1), -1)


def reflected(
    ray_scene: RayScene, chains: Chains, sources: Antennas, targets: Antennas, surfaces: Sequence[Surfaces]
) -> Iterator[Solution]:
    """Solve every chain exactly between every source and target.

    The paths are ordered by the number of reflections, then by target, chain and source.
    """
    counts = (chains >= 0).sum(axis=1)
    for count in np.unique(counts):
        number = np.flatnonzero(counts == count)
        images = Images(ray_scene.planes, np.ascontiguousarray(chains[number, :count]), sources.positions)
        possible = images.possible_paths(targets.positions)
        for start in range(0, possible.shape[1], LANES):
            batch = possible[:, start : start + LANES]
            ways = images.ways(batch, targets.positions)
            target, chain, source = batch
            amplitudes = [path_amplitudes(each, sources, targets, ways) for each in surfaces]
            course = partial(
                _course, ways, sources.positions[source], targets.positions[target], ray_scene, chains.shape[1]
            )
            wavelengths = [each.wavelength for each in surfaces]
            yield Solution(number[chain], target, source, ways.travelled, amplitudes, wavelengths, course)


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
    objects[:, :count] = ray_scene.object_of_face[ways.faces].T
    kinds[:, :count] = Interaction.REFLECTION
    vertices = np.concatenate([starts[:, None], *[ends[:, None]] * (depth + 1)], axis=1)
    vertices[:, 1 : count + 1] = ways.vertices.transpose(2, 0, 1)
    return vertices, objects, kinds


PASSES = 4  # Most objects that a ray passes through

NEAR = 1e-4  # Metres behind a surface at which a ray that leaves it starts


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
