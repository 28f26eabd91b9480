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

from simulate.positions.placement import free_positions
from simulate.rays.core.path_fields import Ways, path_amplitudes
from simulate.rays.core.plane_sequences import distinct, plane_sequences
from simulate.rays.core.propagation import Propagation
from simulate.rays.core.ray_scene import RayScene
from simulate.rays.core.reflections import Images
from simulate.rays.core.sionna_scene import Antennas, gateway_antennas, transmitter_antennas
from simulate.rays.core.solution import Course, Solution, largest_shares
from simulate.rays.core.surfaces import Surfaces
from simulate.rays.core.terms import STRAIGHT, Interaction

Chains = Int[np.ndarray, "chains depth"]
"""Planes that reflect the wave, from source to target; −1 after the last one."""

TRIALS = 200
"""Number of positions at which a chain is tried, from every element. The number is large, since some chains carry power
only within centimetres of one place in the region, or only to one column of the array."""

NEGLIGIBLE = 1e-6
"""A chain is dropped if its share of the power is smaller than this at every trial and every element."""

LANES = 400_000
"""Paths solved at a time. This bounds the memory at some 200 MB."""


def line_of_sight(propagation: Propagation) -> Chains:
    """The chain without reflections if the line of sight is followed, otherwise no chain."""
    return np.full((int(propagation.los), propagation.max_depth), -1)


def find_chains(
    ray_scene: RayScene, region: Float[np.ndarray, "2 3"], seed: int, report: Callable[[str], None]
) -> Chains:
    """Find the chains that carry power from the gateway to anywhere in a region.

    The result depends only on the arguments.
    """
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
    return Course(vertices, objects, kinds)
