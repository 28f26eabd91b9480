"""Find the chains with diffractions that carry power from the gateway into a region.

Rays from the elements, and from positions in the region, found the sequences of planes that reflect waves. A sequence
after which a wave can reach an edge is an arm. Two arms at one edge, or at two edges that a link joins, make a
candidate. Candidates are solved between some elements and some trial positions, those that can be strongest first, and
the chains that carry power there are kept.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from simulate.rays.core.multipath import largest_shares
from simulate.rays.core.reflection_chains import Chains, reflected
from simulate.rays.core.sionna_scene import Antennas
from simulate.rays.diffraction.arms import FoundArms, find_arms
from simulate.rays.diffraction.diffracted_paths import EdgeScene, diffracted
from simulate.rays.diffraction.diffraction_chains import NO_LINK, NO_LINKS, DiffractedChains, chains_of, links_between
from simulate.spectra.spectrum import evenly

MOST_REFLECTIONS = 2
"""Most reflections before and after an edge together. With a third one, spectra came no nearer to full wave."""

MOST_REFLECTIONS_TWICE = 1  # Most reflections of a chain with two diffractions

TRIALS = 64  # Number of positions in the region at which candidates are tried

ELEMENTS = 4
"""Number of elements at which candidates with two diffractions are tried. Those with one are tried at all elements."""

NEGLIGIBLE = 5e-5
"""A chain is dropped if its share of the power is smaller than this at every trial and every element."""

GAIN = 10  # The most by which the patterns of two antennas may favour one path over the others, as a power


def find_diffracted_chains(
    edge_scene: EdgeScene,
    elements: Antennas,
    trials: Antennas,
    sequences: tuple[Chains, Chains],
    reflecting: Chains,
    report: Callable[[str], None],
) -> DiffractedChains:
    """The chains with diffractions that carry power from the gateway to one of some positions.

    ``sequences`` are those of the planes that reflect waves from the elements, and from the positions.
    """
    ray_scene, edges, surfaces = edge_scene.ray_scene, edge_scene.edges, edge_scene.surfaces
    propagation = ray_scene.propagation
    most = max(0, min(MOST_REFLECTIONS, propagation.max_depth - 1)) if propagation.specular else 0
    trials = trials.subset(evenly(np.arange(len(trials)), TRIALS))
    some = elements.subset(evenly(np.arange(len(elements)), ELEMENTS))
    near, far = (
        find_arms(surfaces, ray_scene.mirrors, edges, planes[(planes >= 0).sum(axis=1) <= most], antennas.positions)
        for planes, antennas in zip(sequences, (some, trials), strict=True)
    )
    links = links_between(edges, ray_scene) if propagation.max_depth >= 2 else NO_LINKS
    most_twice = max(0, min(MOST_REFLECTIONS_TWICE, propagation.max_depth - 2, most))
    candidates = chains_of(near.arms, far.arms, links, (most, most_twice))
    print('arms', len(near.arms), len(far.arms), 'links', len(links), 'candidates', len(candidates))
    others = np.zeros((len(trials), len(some)))
    for solution in reflected(ray_scene, reflecting, some, trials, [surfaces]):
        _, paths = solution.arriving()
        np.add.at(others, (paths.targets, paths.sources), np.abs(paths.responses) ** 2)
    bound = _bounds(candidates, near, far) * (surfaces.wavelength / (4 * np.pi)) ** 2
    print('bound/w', np.quantile(bound/others.max(1).min(), [0,.1,.25,.5,.75,.9,1]))
    shares = largest_shares(diffracted(edge_scene, candidates, some, trials, [surfaces]), len(candidates), others)
    print('max shares', (shares>NEGLIGIBLE/10).sum(), (shares>NEGLIGIBLE).sum())
    kept = shares >= NEGLIGIBLE
    chains = candidates.subset(kept)
    twice = int((chains.link != NO_LINK).sum())
    report(
        f"{len(edges)} edges: {len(chains) - twice} chains with a diffraction and {twice} with two, of "
        f"{len(candidates)} tried"
    )
    return chains


def _bounds(candidates: DiffractedChains, near: FoundArms, far: FoundArms) -> Float[np.ndarray, " chains"]:
    first, second = candidates.pairs.T
    return (near.strengths[first] * far.strengths[second] / (near.lengths[first] + far.lengths[second])) ** 2
