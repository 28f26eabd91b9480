"""Chains of interactions: found once by shooting rays, then solved exactly for every element and transmitter.

The gateway never moves and a room has only some hundreds of distinct chains (sequences of interaction types and
reflecting planes) that carry power. Shooting rays anew for every transmitter, as the usual scripts do, finds them
again and again, and each time misses some. We shoot from the corner elements to anchor positions, collect the chains,
and let the image method solve each (chain, element, transmitter).

One path once: a path is identified by its interaction types and the **planes** it is reflected at. Two triangles of
one wall are one plane; a path counts only for the chain whose planes it really hits, so that two nearly coplanar
surfaces never count the same path twice.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Complex, Float, Int
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from scenes.description import Scene
from simulate.paths import (
    NONE,
    SPECULAR,
    Interactions,
    PathsBuffer,
    candidates,
    interactions_of,
    keep,
    refine,
    responses,
    shoot,
)
from simulate.placement import free_positions
from simulate.propagation import Propagation
from simulate.ray_tracer import rt
from simulate.sionna_scene import Antennas, gateway_antennas, transmitter_antennas

PLANE_TOLERANCE = 1e-4
"""Triangles are coplanar when normals (unit vectors) and offsets (metres) agree this closely."""


class Planes:
    """Which plane each triangle of a scene lies in.

    Args:
        scene: the description.
        sionna: its Sionna RT scene.
    """

    def __init__(self, scene: Scene, sionna: rt.Scene):
        normals, corners, self._first, self.vertices = [], [], {}, {}
        count = 0
        for item in scene.objects:
            identifier = int(sionna.objects[item.name].object_id)
            self._first[identifier] = count
            self.vertices[identifier] = np.asarray(item.mesh.triangles[:, 0], dtype=np.float32)
            normals.append(item.mesh.face_normals)
            corners.append(item.mesh.triangles[:, 0])
            count += len(item.mesh.faces)
        normal = np.concatenate(normals)
        offset = (normal * np.concatenate(corners)).sum(axis=1, keepdims=True)
        self._plane = _group(np.hstack([normal, offset]), PLANE_TOLERANCE)

    def of(self, interactions: Interactions) -> Int[np.ndarray, "n depth"]:
        """Plane of each specular reflection, −1 elsewhere: a chain's other interactions do not steer the path."""
        plane = np.full(interactions.types.shape, -1, dtype=np.int64)
        specular = interactions.types == SPECULAR
        first = np.zeros(max(self._first) + 1, dtype=np.int64)
        for identifier, start in self._first.items():
            first[identifier] = start
        plane[specular] = self._plane[first[interactions.shapes[specular]] + interactions.triangles[specular]]
        return plane


def _group(planes: Float[np.ndarray, "n 4"], tolerance: float) -> Int[np.ndarray, " n"]:
    """Label of each plane (normal, offset); a plane and its reverse are one."""
    tree = cKDTree(np.concatenate([planes, -planes]))
    pairs = tree.query_pairs(tolerance, output_type="ndarray") % len(planes)
    graph = coo_array((np.ones(len(pairs)), pairs.T), shape=(len(planes), len(planes)))
    return connected_components(graph, directed=False)[1]


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

TRIALS = 96
"""Positions a candidate is tried at: it is kept where it is a path to at least one of them."""

TOLERANCE = 1e-4
"""Shooting ends when a round from every corner in a row brings less than this share of the power over the trials."""


def find_chains(
    sionna: rt.Scene,
    planes: Planes,
    scene: Scene,
    region: Float[np.ndarray, "2 3"],
    propagation: Propagation,
    report: Callable[[str], None],
) -> Chains:
    """The chains that carry power from the gateway to anywhere in a region.

    Each round shoots rays from another corner element to new anchors in the region, then lets the image method try
    the candidates that were not seen before between all corner elements and positions all over the region. It ends
    when rounds bring no new power. The result depends on the scene, the region and ``propagation`` only.

    Args:
        region: lowest and highest corner, metres, world frame.
        report: takes a sentence on the progress.
    """
    generator = np.random.default_rng(propagation.seed)
    elements = gateway_antennas(scene)
    rows, columns = scene.gateway.rows, scene.gateway.columns
    corners = elements.some(np.unique([0, columns - 1, (rows - 1) * columns, rows * columns - 1]))
    trials = transmitter_antennas(scene, free_positions(scene, region, TRIALS, generator))

    known = seen = line_of_sight(propagation)
    response = solve_chains(sionna, planes, known, corners, trials, propagation)
    quiet = 0
    for number in range(1, MOST_ROUNDS + 1):
        if propagation.max_depth == 0 or quiet == max(2, len(corners)):
            break
        anchors = transmitter_antennas(scene, free_positions(scene, region, ANCHORS, generator))
        # Line of sight is a chain of its own; the rays look for the others.
        rays = replace(propagation, los=False, seed=propagation.seed + number)
        corner = corners.some(np.array([number % len(corners)]))
        buffer = shoot(sionna, corner, anchors, rays, room=HASH_TABLE + 10_007 * number)
        found = interactions_of(buffer)
        candidates_now = seen.merged(Chains(found, planes.of(found)))
        unseen = candidates_now.some(np.arange(len(seen), len(candidates_now)))
        seen = candidates_now
        new = unseen.some(_paths_somewhere(sionna, planes, unseen, corners, trials, propagation))
        brought = solve_chains(sionna, planes, new, corners, trials, propagation)
        known, response = known.merged(new), response + brought
        total = float((np.abs(response) ** 2).sum())
        share = float((np.abs(brought) ** 2).sum()) / total if total > 0 else 0.0
        quiet = quiet + 1 if share < TOLERANCE else 0
        report(f"round {number}: {len(known)} chains, {len(new)} of them new with {share:.1e} of the power")
    return known


def _paths_somewhere(
    sionna: rt.Scene,
    planes: Planes,
    chains: Chains,
    sources: Antennas,
    targets: Antennas,
    propagation: Propagation,
) -> Bool[np.ndarray, " n"]:
    """Which chains are a path between some source and some target."""
    somewhere = np.zeros(len(chains), dtype=bool)
    if len(chains):
        for part in lanes_in_batches(len(chains) * len(sources), len(targets)):
            _, chain = _exact_paths(sionna, planes, chains, sources, targets.some(part), propagation)
            somewhere[chain] = True
    return somewhere


LANES = 400_000
"""Candidate paths solved at once: bounds the memory at some 200 MB."""


def lanes_in_batches(lanes_per_target: int, targets: int) -> list[Int[np.ndarray, " batch"]]:
    """Indices of consecutive targets, as many at once as memory allows; at least one."""
    batch = max(1, LANES // max(1, lanes_per_target))
    return [np.arange(start, min(start + batch, targets)) for start in range(0, targets, batch)]


def _exact_paths(
    sionna: rt.Scene,
    planes: Planes,
    chains: Chains,
    sources: Antennas,
    targets: Antennas,
    propagation: Propagation,
) -> tuple[PathsBuffer, Int[np.ndarray, " paths"]]:
    """Valid paths, and the chain of each, between every source and target."""
    buffer = candidates(chains.interactions, planes.vertices, len(sources), len(targets))
    buffer = refine(sionna, buffer, sources, targets, propagation)
    lanes = np.flatnonzero(buffer.valid.numpy())
    chain = (lanes // len(sources)) % max(1, len(chains))
    buffer.discard_invalid()
    # The image method lets a path hit another, nearly coplanar surface than its chain's: that path is another's.
    own = (planes.of(interactions_of(buffer)) == chains.planes[chain]).all(axis=1)
    return keep(buffer, own), chain[own]


def solve_chains(
    sionna: rt.Scene,
    planes: Planes,
    chains: Chains,
    sources: Antennas,
    targets: Antennas,
    propagation: Propagation,
) -> Complex[np.ndarray, "targets sources"]:
    """Response between every source and target over all chains, each solved exactly."""
    result = np.zeros((len(targets), len(sources)), np.complex128)
    if len(chains):
        for part in lanes_in_batches(len(chains) * len(sources), len(targets)):
            some = targets.some(part)
            buffer, _ = _exact_paths(sionna, planes, chains, sources, some, propagation)
            result[part] = responses(sionna, buffer, sources, some, propagation)
    return result
