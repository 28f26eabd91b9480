"""Chains of interactions: found once by shooting rays, then solved exactly for every element and transmitter.

A chain is a sequence of interaction types and reflecting planes. The gateway never moves, and only some hundreds of
chains in a room carry power. Rays that are shot anew for every transmitter find the same chains again and again, and
miss some each time. Here rays are shot once, from the elements to anchor positions, and the chains that they find are
collected. Then the image method solves each chain for every element and transmitter.

Every path counts once. It is identified by its interaction types and the planes at which it is reflected. Two triangles
of one wall lie in the same plane. A path counts only for the chain whose planes it really hits, so two nearly coplanar
surfaces never count the same path twice.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int

from simulate.positions.placement import free_positions
from simulate.rays.core.planes import Planes
from simulate.rays.core.propagation import Propagation
from simulate.rays.core.ray_scene import RayScene
from simulate.rays.core.ray_tracer import PathsBuffer
from simulate.rays.core.reflections import possible_paths
from simulate.rays.core.sionna_paths import (
    NONE,
    SPECULAR,
    Interactions,
    candidates,
    fields,
    interactions_of,
    keep,
    refine,
    shoot,
)
from simulate.rays.core.sionna_scene import Antennas, gateway_antennas, transmitter_antennas


def reflecting_planes(planes: Planes, interactions: Interactions) -> Int[np.ndarray, "n depth"]:
    """Plane of each specular reflection, −1 for other interactions, which do not change the direction."""
    result = np.full(interactions.types.shape, -1, dtype=np.int64)
    specular = interactions.types == SPECULAR
    result[specular] = planes.of(interactions.shapes[specular], interactions.triangles[specular])
    return result


@dataclass(frozen=True)
class Chains:
    """Distinct chains. No two have the same interaction types and reflecting planes.

    Attributes:
        interactions: interactions of each chain, from source to target.
        planes: index of the plane of each specular reflection, −1 for other interactions.
    """

    interactions: Interactions
    planes: Int[np.ndarray, "n depth"]

    def __len__(self) -> int:
        return len(self.interactions)

    def subset(self, index: Int[np.ndarray, " k"] | Bool[np.ndarray, " n"]) -> Chains:
        """The chains with these indices, or those that a mask selects."""
        chosen = Interactions(
            self.interactions.types[index],
            self.interactions.shapes[index],
            self.interactions.triangles[index],
        )
        return Chains(chosen, self.planes[index])

    def renamed(self, names: Int[np.ndarray, " objects"]) -> Chains:
        """The same chains, with ``names[i]`` as the identifier of object i."""
        happened = self.interactions.types != NONE
        shapes = np.zeros_like(self.interactions.shapes)
        shapes[happened] = names[self.interactions.shapes[happened]]
        return replace(self, interactions=replace(self.interactions, shapes=shapes))

    def merged(self, others: Chains) -> Chains:
        """These chains, followed by those of the others that are new."""
        types = np.concatenate([self.interactions.types, others.interactions.types])
        planes = np.concatenate([self.planes, others.planes])
        keys = np.concatenate([types.astype(np.int64), planes], axis=1)
        _, first = np.unique(keys, axis=0, return_index=True)
        shapes = np.concatenate([self.interactions.shapes, others.interactions.shapes])
        triangles = np.concatenate([self.interactions.triangles, others.interactions.triangles])
        return Chains(Interactions(types, shapes, triangles), planes).subset(np.sort(first))


def line_of_sight(propagation: Propagation) -> Chains:
    """The chain without interactions if the line of sight is followed, otherwise no chain."""
    shape = (int(propagation.los), max(1, propagation.max_depth))
    nothing = np.full(shape, NONE, np.uint32)
    return Chains(Interactions(nothing, nothing, nothing), np.full(shape, -1))


ANCHORS, MOST_ROUNDS = 2, 32
"""Anchors per round of shooting, and largest number of rounds. There are only two anchors, since Sionna drops
candidates whose hashes collide, and more anchors make more collisions."""

HASH_TABLE = 1_000_003
"""Size of Sionna's table of known chains. Each round uses another size, so that a chain that is lost to a collision in
one round is found in the next."""

TRIALS = 200
"""Number of positions at which a candidate is tried, from every element. It is kept if it is a path to one of them. The
number is large, since some chains carry power only within centimetres of one place in the region, or only to one column
of the array."""

QUIET_ROUNDS, TOLERANCE = 4, 1e-4
"""Shooting ends after this many rounds in a row that each bring less than this share of the power at the trials."""

NEGLIGIBLE = 1e-6
"""A chain is dropped if its share of the power is smaller than this at every trial and every element."""


def find_chains(
    ray_scene: RayScene, region: Float[np.ndarray, "2 3"], seed: int, report: Callable[[str], None]
) -> Chains:
    """Find the chains that carry power from the gateway to anywhere in a region.

    Each round shoots rays from another element to new anchors in the region. The image method then tries the new
    candidates between all elements and positions all over the region. The search ends when rounds bring no new power.
    The result depends only on the arguments.

    Args:
        ray_scene: the scene, with the propagation to follow.
        region: lowest and highest corner of the region, metres, world frame.
        seed: seed of the rays, the anchors and the trial positions.
        report: gets a sentence on the progress after each round.

    Returns:
        The chains, line of sight first.
    """
    scene, propagation = ray_scene.description, ray_scene.propagation
    generator = np.random.default_rng(seed)
    elements = gateway_antennas(scene)
    trials = transmitter_antennas(scene, free_positions(scene, region, TRIALS, generator))
    # The line of sight is added as a chain, so the rays need to find only the others.
    reflected = replace(ray_scene, propagation=replace(propagation, los=False))

    def tried(chains: Chains) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Chain, pair of trial and element (as one number) and power of every path between elements and trials."""
        found = [(np.zeros(0, int), np.zeros(0, int), np.zeros(0))]
        for chain, buffer in solve_chains(ray_scene, chains, elements, trials):
            paths = fields(ray_scene, buffer, elements, trials)
            found.append((chain, paths.targets * len(elements) + paths.sources, np.abs(paths.responses) ** 2))
        chain, pair, power = (np.concatenate(column) for column in zip(*found, strict=True))
        return chain, pair, power

    known = seen = line_of_sight(propagation)
    chain, pair, power = tried(known)
    quiet_rounds = 0
    for number in range(1, MOST_ROUNDS + 1):
        if propagation.max_depth == 0 or quiet_rounds == QUIET_ROUNDS:
            break
        anchors = transmitter_antennas(scene, free_positions(scene, region, ANCHORS, generator))
        element = elements.subset(generator.integers(len(elements), size=1))
        buffer = shoot(reflected, element, anchors, seed + number, most_paths=HASH_TABLE + 10_007 * number)
        shot = interactions_of(buffer)
        all_seen = seen.merged(Chains(shot, reflecting_planes(ray_scene.planes, shot)))
        unseen = all_seen.subset(np.arange(len(seen), len(all_seen)))
        seen = all_seen
        chain_of_path, new_pair, new_power = tried(unseen)
        new, new_chain = np.unique(chain_of_path, return_inverse=True)
        chain = np.concatenate([chain, len(known) + new_chain])
        pair, power = np.concatenate([pair, new_pair]), np.concatenate([power, new_power])
        known = known.merged(unseen.subset(new))
        new_share = float(new_power.sum() / power.sum()) if len(power) else 0.0
        quiet_rounds = quiet_rounds + 1 if new_share < TOLERANCE else 0
        report(f"round {number}: {len(known)} chains, {len(new)} of them new with {new_share:.1e} of the power")
    carries_power = largest_shares(chain, pair, power, len(known)) >= NEGLIGIBLE
    return known.subset(carries_power | (known.interactions.types[:, 0] == NONE))


def largest_shares(
    chain: Int[np.ndarray, " paths"], pair: Int[np.ndarray, " paths"], power: Float[np.ndarray, " paths"], chains: int
) -> Float[np.ndarray, " chains"]:
    """The largest share of the power between two antennas that each chain carries.

    Args:
        chain: index of each path's chain.
        pair: number of each path's pair of antennas.
        power: power of each path.
        chains: number of chains.
    """
    share = power / np.maximum(np.bincount(pair, power)[pair], 1e-30)
    result = np.zeros(chains)
    np.maximum.at(result, chain, share)
    return result


LANES = 400_000
"""Candidate paths solved at a time. This bounds the memory at some 200 MB."""


def solve_chains(
    ray_scene: RayScene, chains: Chains, sources: Antennas, targets: Antennas
) -> Iterator[tuple[Int[np.ndarray, " paths"], PathsBuffer]]:
    """Solve every chain exactly between every source and target.

    The paths are ordered by target, chain and source. The paths of one target do not depend on the other targets.

    Args:
        ray_scene: the scene, with the propagation to follow.
        chains: the chains to solve.
        sources: where the paths begin.
        targets: where they end.

    Yields:
        Batches of valid paths, and the index of each path's chain.
    """
    planes = ray_scene.planes
    possible = possible_paths(planes, chains.planes, sources.positions, targets.positions)
    for start in range(0, possible.shape[1], LANES):
        target, chain, source = possible[:, start : start + LANES]
        buffer = candidates(chains.interactions, planes.vertices, chain, source, target)
        buffer = refine(ray_scene, buffer, sources, targets)
        chain = chain[buffer.valid.numpy()]
        buffer.discard_invalid()
        # With the image method a path may hit a surface that is nearly coplanar with its chain's surface. Such a path
        # belongs to the chain of the surface that it hits, and is dropped here.
        hits_own_planes = (reflecting_planes(planes, interactions_of(buffer)) == chains.planes[chain]).all(axis=1)
        yield chain[hits_own_planes], keep(buffer, hits_own_planes)
