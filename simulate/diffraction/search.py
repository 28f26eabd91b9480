"""Find the chains with one diffraction that carry power from the gateway into a region.

Rays shot from the elements, and from positions in the region, find the sequences of planes that waves are reflected
at. Those after which a wave can reach an edge are arms; the pairs of arms at an edge are candidates, which are kept
where they bring power to one of some trial positions.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from jaxtyping import Float, Int

from simulate.chains import largest_shares
from simulate.diffraction.arms import Arms, reflection_sequences
from simulate.diffraction.chains import DiffractedChains, chains_of
from simulate.diffraction.geometry import ends_of, reaches
from simulate.diffraction.solve import EdgeScene, diffracted_paths
from simulate.placement import free_positions
from simulate.sionna_scene import gateway_antennas, transmitter_antennas

MOST_REFLECTIONS = 2
"""Reflections before and after an edge together. With a third the spectra came no nearer to full wave."""

TRIALS = 64
"""Positions in the region from which rays are shot, and at which candidates are tried."""

NEGLIGIBLE = 1e-5
"""A chain is dropped if it brings less than this share of the diffracted power at every trial and every element."""


def find_diffracted_chains(
    edge_scene: EdgeScene, region: Float[np.ndarray, "2 3"], seed: int, report: Callable[[str], None]
) -> DiffractedChains:
    """The chains with one diffraction that carry power from the gateway to anywhere in a region.

    Args:
        edge_scene: the scene and its edges.
        region: lowest and highest corner, metres, world frame.
        seed: seed of the rays and the trial positions.
        report: called with a sentence on the progress.
    """
    ray_scene = edge_scene.ray_scene
    scene, propagation = ray_scene.description, ray_scene.propagation
    generator = np.random.default_rng(seed)
    elements = gateway_antennas(scene)
    trials = transmitter_antennas(scene, free_positions(scene, region, TRIALS, generator))
    most = max(0, min(MOST_REFLECTIONS, propagation.max_depth - 1)) if propagation.specular else 0

    def arms(antennas: Float[np.ndarray, "antennas 3"]) -> Arms:
        sequences = reflection_sequences(ray_scene, antennas, most, propagation.rays, generator)
        return _possible_arms(edge_scene, sequences, antennas)

    candidates = chains_of(arms(elements.positions), arms(trials.positions), most)
    found = [(np.zeros(0, int), np.zeros(0, int), np.zeros(0))]
    for index, paths in diffracted_paths(edge_scene, candidates, elements, trials):
        found.append((index, paths.targets * len(elements) + paths.sources, np.abs(paths.responses) ** 2))
    chain, pair, power = (np.concatenate(column) for column in zip(*found, strict=True))
    chains = candidates.subset(largest_shares(chain, pair, power, len(candidates)) >= NEGLIGIBLE)
    report(f"{len(edge_scene.edges)} edges: {len(chains)} chains with a diffraction, of {len(candidates)} tried")
    return chains


def _possible_arms(
    edge_scene: EdgeScene, sequences: Int[np.ndarray, "sequences most"], antennas: Float[np.ndarray, "antennas 3"]
) -> Arms:
    """The sequences of reflections after which a wave from one of some antennas reaches an edge."""
    planes, edges = edge_scene.ray_scene.planes, edge_scene.edges
    found = [Arms(sequences[:0], np.zeros(0, np.int64))]
    for edge in range(len(edges)):
        arms = Arms(sequences, np.full(len(sequences), edge))
        found.append(arms.subset(reaches(planes, edges, arms, ends_of(planes, edges, arms, antennas))))
    return Arms(np.concatenate([arms.planes for arms in found]), np.concatenate([arms.edges for arms in found]))
