"""Find the chains with diffractions that carry power from the gateway into a region.

Rays shot from the elements, and from positions in the region, find the sequences of planes that waves are reflected
at. Those after which a wave can reach an edge are arms. Two arms at one edge, or at two edges that a link joins, are a
candidate; it is kept if it brings power to one of some trial positions.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from jaxtyping import Float, Int

from simulate.positions.placement import free_positions
from simulate.rays.core.reflection_chains import largest_shares
from simulate.rays.core.sionna_scene import Antennas, gateway_antennas, transmitter_antennas
from simulate.rays.diffraction.arms import Arms, reflection_sequences
from simulate.rays.diffraction.diffraction_chains import NO_LINK, DiffractedChains, chains_of
from simulate.rays.diffraction.ends import ends_of, reaches
from simulate.rays.diffraction.links import NO_LINKS, links_between
from simulate.rays.diffraction.solve import EdgeScene, diffracted_paths
from simulate.spectra.spectrum import evenly

MOST_REFLECTIONS = 2
"""Reflections before and after an edge together. With a third the spectra came no nearer to full wave."""

MOST_REFLECTIONS_TWICE = 1
"""Reflections of a chain with two diffractions."""

TRIALS = 64
"""Positions in the region from which rays are shot, and at which candidates are tried."""

ELEMENTS = 4
"""Number of the gateway's elements at which candidates with two diffractions are tried; those with one are tried at
all."""

NEGLIGIBLE = 1e-4
"""A chain is dropped if it brings less than this share of the diffracted power at every trial and every element."""


def find_diffracted_chains(
    edge_scene: EdgeScene, region: Float[np.ndarray, "2 3"], seed: int, report: Callable[[str], None]
) -> DiffractedChains:
    """The chains with diffractions that carry power from the gateway to anywhere in a region.

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

    links = links_between(edge_scene.edges, ray_scene) if propagation.max_depth >= 2 else NO_LINKS
    most_twice = max(0, min(MOST_REFLECTIONS_TWICE, propagation.max_depth - 2, most))
    candidates = chains_of(arms(elements.positions), arms(trials.positions), links, (most, most_twice))
    is_double = candidates.link != NO_LINK
    some = elements.subset(evenly(np.arange(len(elements)), ELEMENTS))
    kept = _shares(edge_scene, candidates, some, trials) >= NEGLIGIBLE
    kept[~is_double] = _shares(edge_scene, candidates.subset(~is_double), elements, trials) >= NEGLIGIBLE
    chains = candidates.subset(kept)
    twice = int((chains.link != NO_LINK).sum())
    if edge_scene.left_out:
        report(f"the {edge_scene.left_out} least of the edges are left out")
    report(
        f"{len(edge_scene.edges)} edges: {len(chains) - twice} chains with a diffraction and {twice} with two, of "
        f"{len(candidates)} tried"
    )
    return chains


def _shares(
    edge_scene: EdgeScene, chains: DiffractedChains, sources: Antennas, targets: Antennas
) -> Float[np.ndarray, " chains"]:
    """The largest share of the diffracted power between a source and a target that each chain brings."""
    found = [(np.zeros(0, int), np.zeros(0, int), np.zeros(0))]
    for index, paths in diffracted_paths(edge_scene, chains, sources, targets):
        found.append((index, paths.targets * len(sources) + paths.sources, np.abs(paths.responses) ** 2))
    chain, pair, power = (np.concatenate(column) for column in zip(*found, strict=True))
    return largest_shares(chain, pair, power, len(chains))


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
