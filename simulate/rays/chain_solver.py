"""Paths of chains: the chains that carry power are found once, then solved exactly for all elements and transmitters.

Chains of reflections are found first, then those with diffractions.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float, Int

from simulate.rays.core.band_sum import BandSum
from simulate.rays.core.ray_scene import RayScene
from simulate.rays.core.reflection_chains import Chains, find_chains, reflected
from simulate.rays.core.sionna_scene import Antennas
from simulate.rays.core.solution import Solution
from simulate.rays.core.surfaces import Surfaces
from simulate.rays.core.terms import Paths, Terms
from simulate.rays.diffraction.diffraction_chains import DiffractedChains
from simulate.rays.diffraction.edges import Edges
from simulate.rays.diffraction.search import find_diffracted_chains
from simulate.rays.diffraction.solve import EdgeScene, diffracted


class Found(NamedTuple):
    """The chains that a tracer found, for another tracer of the same scene and propagation."""

    # chains of reflections, which name the scene's planes; None if rays are shot for every batch instead
    reflected: Chains | None
    diffracted: DiffractedChains | None  # chains with diffractions; None if diffraction is not followed
    # the edges that the chains with diffractions name, for a scene whose objects have not moved. None: they are found
    # again.
    edges: Edges | None = None


class ChainSolver:
    """The chains of reflections and diffractions in a scene, and the paths that they give between antennas.

    Paths name their chain by its number. Chains without diffraction come first.
    """

    def __init__(
        self,
        ray_scene: RayScene,
        region: Float[np.ndarray, "2 3"],
        seed: int,
        report: Callable[[str], None],
        found: Found | None,
    ):
        self._ray_scene, self._surfaces = ray_scene, Surfaces(ray_scene)
        given = Found(None, None) if found is None else found
        self._reflected = find_chains(ray_scene, region, seed, report) if given.reflected is None else given.reflected
        self._diffracted: DiffractedChains | None = None
        self.found, self.chains = Found(self._reflected, None), len(self._reflected)
        if ray_scene.propagation.diffraction and ray_scene.propagation.max_depth > 0:
            self._edge_scene = EdgeScene(ray_scene, given.edges)
            self._diffracted = given.diffracted
            if self._diffracted is None:
                self._diffracted = find_diffracted_chains(self._edge_scene, self._reflected, region, seed, report)
            self.found = Found(self._reflected, self._diffracted, self._edge_scene.edges)
            self.chains += len(self._diffracted)

    def paths(self, sources: Antennas, targets: Antennas) -> Iterator[tuple[Int[np.ndarray, " paths"], Paths]]:
        """The paths between all sources and targets, in batches: the chain of each path, and the paths."""
        for solution in self._solved(sources, targets, [self._surfaces]):
            yield solution.arriving()

    def terms(self, sources: Antennas, targets: Antennas) -> Iterator[Terms]:
        """The paths of ``paths``, with their vertices but without those of transmissions."""
        for solution in self._solved(sources, targets, [self._surfaces]):
            yield solution.terms()

    def paths_in(self, others: Sequence[RayScene], sources: Antennas, targets: Antennas) -> Iterator[tuple[int, Paths]]:
        """The same paths in scenes of other materials, in batches: index of the scene, and the paths in it."""
        for solution in self._solved(sources, targets, [Surfaces(each) for each in others]):
            yield from enumerate(solution.paths)

    def band_responses(
        self, sources: Antennas, targets: Antennas, frequencies: Float[np.ndarray, " subcarriers"]
    ) -> Complex[np.ndarray, "targets sources subcarriers"]:
        """The sum of all paths from each source to each target, at each subcarrier."""
        # No leg of a path is longer than the scene, and a path has one leg more than interactions.
        antennas = np.vstack([sources.positions, targets.positions, self._ray_scene.description.bounds])
        diagonal = float(np.linalg.norm(np.ptp(antennas, axis=0)))
        longest = diagonal * (self._ray_scene.propagation.max_depth + 1)
        sum_over_paths = BandSum(frequencies, len(targets), len(sources), longest)
        surfaces = [Surfaces(self._ray_scene, frequency) for frequency in sum_over_paths.solved]
        for solution in self._solved(sources, targets, surfaces):
            sum_over_paths.add(solution)
        return sum_over_paths.total

    def _solved(self, sources: Antennas, targets: Antennas, surfaces: Sequence[Surfaces]) -> Iterator[Solution]:
        """The paths of all chains, of reflections first, with each of some sets of materials."""
        yield from reflected(self._ray_scene, self._reflected, sources, targets, surfaces)
        if self._diffracted is not None:
            for solution in diffracted(self._edge_scene, self._diffracted, sources, targets, surfaces):
                yield solution._replace(chain=len(self._reflected) + solution.chain)
