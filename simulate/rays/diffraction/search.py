"""Find the chains with diffractions that carry power from the gateway into a region.

Rays from the elements, and from positions in the region, found the sequences of planes that reflect waves. A sequence
after which a wave can reach an edge is an arm. Two arms at one edge, or at two edges that a link joins, make a
candidate. Candidates are solved between some elements and some trial positions, those that can be strongest first, and
the chains that carry power there are kept.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
from jaxtyping import Float, Int

from scenes.files.long_work import doing
from simulate.rays.core.propagation import Propagation
from simulate.rays.core.reflection_chains import Chains, reflected
from simulate.rays.core.shooting import Explored
from simulate.rays.core.sionna_scene import Antennas
from simulate.rays.core.solution import Solution, Tried, largest_shares
from simulate.rays.core.surfaces import Surfaces
from simulate.rays.diffraction.arm_search import FoundArms, find_arms
from simulate.rays.diffraction.beams import promise_of
from simulate.rays.diffraction.diffracted_paths import EdgeScene, diffracted
from simulate.rays.diffraction.diffraction_chains import NO_LINK, NO_LINKS, DiffractedChains, chains_of, links_between
from simulate.rays.diffraction.edges import Edges
from simulate.rays.diffraction.passing_rays import PassingRays
from simulate.spectra.spectrum import evenly

MOST_REFLECTIONS = 2
"""Most reflections before and after an edge together. With a third one, spectra came no nearer to full wave."""

MOST_REFLECTIONS_TWICE = 1  # Most reflections of a chain with two diffractions

MOST = 300_000  # Most candidates that are tried, those that promise the strongest waves

MOST_LINKED = 300  # Most edges between which a wave that is diffracted twice is followed

ELEMENTS = 4  # Number of elements between which the trial positions are shared

NEGLIGIBLE = 5e-5
"""A chain is dropped if its share of the power is smaller than this at every trial and every element."""

STRONGER = 10_000
"""The most by which a diffracted wave's power may exceed what it promises, near a boundary or by antennas' patterns."""

TURNED = 2  # How much larger an amplitude may be than in empty space, since slabs turn the field before an edge

SECONDS, PER_BEAM = 3e-5, 1e-9  # Seconds that a candidate takes, and a beam for each edge, on two cores

SHADOWED = 0.1
"""The share of the positions with the weakest reflected waves. Beside these, weak diffracted waves are left out."""


def most_reflections(propagation: Propagation) -> int:
    """The most reflections of a chain with a diffraction."""
    return max(0, min(MOST_REFLECTIONS, propagation.max_depth - 1)) if propagation.specular else 0


def find_diffracted_chains(
    edge_scene: EdgeScene,
    elements: Antennas,
    trials: Antennas,
    explored: tuple[Explored, Explored],
    rays: tuple[PassingRays, PassingRays],
    reflecting: Chains,
    report: Callable[[str], None],
) -> DiffractedChains:
    """The chains with diffractions that carry power from the gateway to one of some positions.

    ``explored`` is what rays from the elements found, and rays from the positions; ``rays`` are the edges they passed.
    """
    ray_scene, edges, surfaces = edge_scene.ray_scene, edge_scene.edges, edge_scene.surfaces
    propagation = ray_scene.propagation
    some = elements.subset(evenly(np.arange(len(elements)), ELEMENTS))
    own = np.arange(len(trials)) % len(some)  # each position is tried with one element
    ends = some, trials, [surfaces]
    others = _powers(reflected(ray_scene, reflecting, *ends, Tried(own, np.zeros(len(trials)))), len(trials))
    least = _least(others, surfaces)
    forth, back = explored
    beams = len(forth.short) + len(back.short)
    doing(f"finding which of {len(edges):,} edges {beams:,} beams meet", PER_BEAM * beams * len(edges))
    at = surfaces, ray_scene.mirrors, edges, edge_scene.wedges
    near = find_arms(*at, forth, some, trials, rays[0], least)
    far = find_arms(*at, back, trials, some, rays[1], least)
    links = links_between(edges, _linked(near, far, len(edges)), ray_scene) if propagation.max_depth >= 2 else NO_LINKS
    most = most_reflections(propagation)
    most_twice = max(0, min(MOST_REFLECTIONS_TWICE, propagation.max_depth - 2, most))
    candidates = chains_of(near.arms, far.arms, links, (most, most_twice))
    promises = _promises(candidates, near, far, edges, surfaces)
    strongest = np.sort(np.argsort(-promises, kind="stable")[:MOST])
    candidates = candidates.subset(strongest[promises[strongest] >= least])
    doing(f"trying {len(candidates):,} chains with diffractions at {len(edges):,} edges", SECONDS * len(candidates))
    tried = Tried(own, np.sqrt(NEGLIGIBLE * others) / TURNED)
    solutions = diffracted(edge_scene, candidates, *ends, tried)
    shares = largest_shares(solutions, len(candidates), np.tile(others[:, None], len(some)))
    kept = shares >= NEGLIGIBLE
    chains = candidates.subset(kept)
    twice = int((chains.link != NO_LINK).sum())
    report(
        f"{len(edges)} edges: {len(chains) - twice} chains with a diffraction and {twice} with two, of "
        f"{len(candidates)} tried"
    )
    return chains


def _powers(solutions: Iterable[Solution], trials: int) -> Float[np.ndarray, " trials"]:
    """The power of all paths to each position."""
    powers = np.zeros(trials)
    for solution in solutions:
        _, paths = solution.arriving()
        np.add.at(powers, paths.targets, np.abs(paths.responses) ** 2)
    return powers


def _least(powers: Float[np.ndarray, " trials"], surfaces: Surfaces) -> float:
    """The weakest promise of a wave that may matter beside those of some powers."""
    received = powers[powers > 0]
    if not len(received):
        return 0.0
    weak = np.quantile(received, SHADOWED) / (surfaces.wavelength / (4 * np.pi)) ** 2
    return float(np.sqrt(NEGLIGIBLE / STRONGER * weak))


def _linked(near: FoundArms, far: FoundArms, count: int) -> Int[np.ndarray, " k"]:
    """The edges that waves reach from either end, at most ``MOST_LINKED``, those with the strongest waves."""
    strongest = np.zeros(count)
    for found in (near, far):
        np.maximum.at(strongest, found.arms.edges, found.strengths / found.lengths)
    order = np.argsort(-strongest, kind="stable")[:MOST_LINKED]
    return np.sort(order[strongest[order] > 0])


def _promises(
    candidates: DiffractedChains, near: FoundArms, far: FoundArms, edges: Edges, surfaces: Surfaces
) -> Float[np.ndarray, " chains"]:
    """About how strong each chain can be."""
    first, second = candidates.pairs.T
    begin, end = candidates.edges.T
    middle = edges.points(np.array([0.5]))[:, 0]
    between = np.linalg.norm(middle[begin] - middle[end], axis=1)
    strengths = near.strengths[first] * far.strengths[second]
    before, behind = near.lengths[first], far.lengths[second]
    once = promise_of(surfaces.wavelength, before, between + behind)
    twice = np.maximum(once, promise_of(surfaces.wavelength, before + between, behind))
    return strengths * np.where(candidates.link == NO_LINK, once, twice)
