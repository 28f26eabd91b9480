"""Chains of interactions: found once by shooting rays, then solved exactly for every element and transmitter.

The gateway never moves and a room has only some hundreds of distinct chains (sequences of interaction types and
reflecting planes) that carry power. Shooting rays anew for every transmitter, as the usual scripts do, finds them
again and again, and each time misses some. We shoot from the elements to anchor positions, collect the chains, and
let the image method solve each (chain, element, transmitter).

One path once: a path is identified by its interaction types and the **planes** it is reflected at. Two triangles of
one wall are one plane; a path counts only for the chain whose planes it really hits, so that two nearly coplanar
surfaces never count the same path twice.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int

from scenes.description import Scene
from simulate.paths import (
    NONE,
    SPECULAR,
    Interactions,
    Paths,
    candidates,
    fields,
    interactions_of,
    keep,
    refine,
    shoot,
)
from simulate.placement import free_positions
from simulate.planes import Planes
from simulate.propagation import Propagation
from simulate.ray_tracer import PathsBuffer, rt
from simulate.reflections import possible_paths
from simulate.sionna_scene import Antennas, gateway_antennas, transmitter_antennas


def reflecting_planes(planes: Planes, interactions: Interactions) -> Int[np.ndarray, "n depth"]:
    """Plane of each specular reflection, −1 elsewhere: a chain's other interactions do not steer the path."""
    result = np.full(interactions.types.shape, -1, dtype=np.int64)
    specular = interactions.types == SPECULAR
    result[specular] = planes.of(interactions.shapes[specular], interactions.triangles[specular])
    return result


@dataclass(frozen=True)
class Chains:
    """Distinct chains: no two have the same interaction types and reflecting planes."""

    interactions: Interactions
    planes: Int[np.ndarray, "n depth"]

    def __len__(self) -> int:
        return len(self.interactions)

    def some(self, index: np.ndarray) -> Chains:
        """The chains at these indices (or of this mask)."""
        chosen = Interactions(
            self.interactions.types[index],
            self.interactions.shapes[index],
            self.interactions.triangles[index],
        )
        return Chains(chosen, self.planes[index])

    def renamed(self, names: Int[np.ndarray, " n"]) -> Chains:
        """The same chains where object i is called ``names[i]``."""
        happened = self.interactions.types != NONE
        shapes = np.zeros_like(self.interactions.shapes)
        shapes[happened] = names[self.interactions.shapes[happened]]
        return replace(self, interactions=replace(self.interactions, shapes=shapes))

    def merged(self, others: Chains) -> Chains:
        """These chains and those of the others that are new; these keep their places."""
        types = np.concatenate([self.interactions.types, others.interactions.types])
        planes = np.concatenate([self.planes, others.planes])
        keys = np.concatenate([types.astype(np.int64), planes], axis=1)
        _, first = np.unique(keys, axis=0, return_index=True)
        shapes = np.concatenate([self.interactions.shapes, others.interactions.shapes])
        triangles = np.concatenate([self.interactions.triangles, others.interactions.triangles])
        return Chains(Interactions(types, shapes, triangles), planes).some(np.sort(first))


def line_of_sight(propagation: Propagation) -> Chains:
    """The chain without interactions, where line of sight is wanted."""
    shape = (int(propagation.los), max(1, propagation.max_depth))
    nothing = np.full(shape, NONE, np.uint32)
    return Chains(Interactions(nothing, nothing, nothing), np.full(shape, -1))


ANCHORS, MOST_ROUNDS = 2, 32
"""Anchors per round of shooting; few, since Sionna drops candidates whose hashes collide, and more so with more."""

HASH_TABLE = 1_000_003
"""Size of Sionna's table of known chains, another one each round: a chain lost to a collision is found the next."""

TRIALS = 200
"""Positions a candidate is tried at, from every element: it is kept where it is a path to one of them. Many, since some
chains serve a hand's breadth of the region, or one column of the array."""

QUIET_ROUNDS, TOLERANCE = 4, 1e-4
"""Shooting ends when so many rounds in a row each bring less than this share of the power over the trials."""

NEGLIGIBLE = 1e-6
"""A chain is dropped if at no trial and no element it brings this share of the power."""


def find_chains(
    sionna: rt.Scene,
    planes: Planes,
    scene: Scene,
    region: Float[np.ndarray, "2 3"],
    propagation: Propagation,
    report: Callable[[str], None],
) -> Chains:
    """The chains that carry power from the gateway to anywhere in a region.

    Each round shoots rays from another element to new anchors in the region, then lets the image method try the
    candidates that were not seen before between all elements and positions all over the region. It ends when rounds
    bring no new power. The result depends on the scene, the region and ``propagation`` only.

    Args:
        region: lowest and highest corner, metres, world frame.
        report: takes a sentence on the progress.
    """
    generator = np.random.default_rng(propagation.seed)
    elements = gateway_antennas(scene)
    trials = transmitter_antennas(scene, free_positions(scene, region, TRIALS, generator))

    def tried(chains: Chains) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Every path of the chains to a trial: its chain, its (trial, element) as one number, its power."""
        found = [(np.zeros(0, int), np.zeros(0, int), np.zeros(0))]
        for chain, paths in paths_of_chains(sionna, planes, chains, elements, trials, propagation):
            found.append((chain, paths.targets * len(elements) + paths.sources, np.abs(paths.responses) ** 2))
        chain, lane, power = (np.concatenate(column) for column in zip(*found, strict=True))
        return chain, lane, power

    known = seen = line_of_sight(propagation)
    chain, lane, power = tried(known)
    quiet = 0
    for number in range(1, MOST_ROUNDS + 1):
        if propagation.max_depth == 0 or quiet == QUIET_ROUNDS:
            break
        anchors = transmitter_antennas(scene, free_positions(scene, region, ANCHORS, generator))
        # Line of sight is a chain of its own; the rays look for the others.
        rays = replace(propagation, los=False, seed=propagation.seed + number)
        element = elements.some(generator.integers(len(elements), size=1))
        buffer = shoot(sionna, element, anchors, rays, room=HASH_TABLE + 10_007 * number)
        found = interactions_of(buffer)
        candidates_now = seen.merged(Chains(found, reflecting_planes(planes, found)))
        unseen = candidates_now.some(np.arange(len(seen), len(candidates_now)))
        seen = candidates_now
        chain_new, lane_new, power_new = tried(unseen)
        new, which = np.unique(chain_new, return_inverse=True)
        chain = np.concatenate([chain, len(known) + which])
        lane, power = np.concatenate([lane, lane_new]), np.concatenate([power, power_new])
        known = known.merged(unseen.some(new))
        share = float(power_new.sum() / power.sum()) if len(power) else 0.0
        quiet = quiet + 1 if share < TOLERANCE else 0
        report(f"round {number}: {len(known)} chains, {len(new)} of them new with {share:.1e} of the power")
    share = power / np.bincount(lane, power, len(trials) * len(elements))[lane]
    largest = np.zeros(len(known))
    np.maximum.at(largest, chain, share)
    return known.some((largest >= NEGLIGIBLE) | (known.interactions.types[:, 0] == NONE))


LANES = 400_000
"""Candidate paths solved at once: bounds the memory at some 200 MB."""


def paths_of_chains(
    sionna: rt.Scene,
    planes: Planes,
    chains: Chains,
    sources: Antennas,
    targets: Antennas,
    propagation: Propagation,
) -> Iterator[tuple[Int[np.ndarray, " paths"], Paths]]:
    """Every chain between every source and target, solved exactly: batches of paths and the chain of each.

    They come ordered by target, chain and source, and those of one target do not depend on the other targets.
    """
    for chain, buffer in solve_chains(sionna, planes, chains, sources, targets, propagation):
        yield chain, fields(sionna, buffer, sources, targets, propagation)


def solve_chains(
    sionna: rt.Scene,
    planes: Planes,
    chains: Chains,
    sources: Antennas,
    targets: Antennas,
    propagation: Propagation,
) -> Iterator[tuple[Int[np.ndarray, " paths"], PathsBuffer]]:
    """The geometry alone of ``paths_of_chains``: batches of valid paths and the chain of each."""
    possible = possible_paths(planes, chains.planes, sources.positions, targets.positions)
    for start in range(0, possible.shape[1], LANES):
        target, chain, source = possible[:, start : start + LANES]
        buffer = candidates(chains.interactions, planes.vertices, chain, source, target)
        buffer = refine(sionna, buffer, sources, targets, propagation)
        chain = chain[buffer.valid.numpy()]
        buffer.discard_invalid()
        # The image method lets a path hit another, nearly coplanar surface than its chain's: that path is another's.
        own = (reflecting_planes(planes, interactions_of(buffer)) == chains.planes[chain]).all(axis=1)
        yield chain[own], keep(buffer, own)
