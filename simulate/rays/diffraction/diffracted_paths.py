"""The paths of chains with diffractions between sources and targets."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from simulate.rays.core.ray_scene import RayScene
from simulate.rays.core.sionna_scene import Antennas
from simulate.rays.core.solution import Solution, Tried, solutions
from simulate.rays.core.surfaces import Surfaces
from simulate.rays.diffraction.chain_geometry import Combinations
from simulate.rays.diffraction.diffraction_chains import DiffractedChains
from simulate.rays.diffraction.diffraction_points import Wedge
from simulate.rays.diffraction.edges import Edges, diffracting_edges


class EdgeScene:
    """A scene with its edges."""

    def __init__(self, ray_scene: RayScene, surfaces: Surfaces, edges: Edges | None = None):
        self.ray_scene, self.surfaces = ray_scene, surfaces
        self.edges: Edges = diffracting_edges(ray_scene) if edges is None else edges
        self.wedges = Wedge.of(self.edges)  # the same, on the ray tracer's device


def diffracted(
    edge_scene: EdgeScene,
    chains: DiffractedChains,
    sources: Antennas,
    targets: Antennas,
    surfaces: Sequence[Surfaces],
    tried: Tried | None = None,
) -> Iterator[Solution]:
    """Solve every chain between every source and target, in the order of shapes, then target, chain and source."""
    ray_scene, shapes = edge_scene.ray_scene, chains.shapes
    for shape in np.unique(shapes, axis=0):
        number = np.nonzero((shapes == shape).all(axis=1))[0]
        combinations = Combinations(
            ray_scene.mirrors,
            edge_scene.edges,
            edge_scene.wedges,
            chains.subset(number),
            sources.positions,
            ray_scene.description.wavelength,
        )
        yield from solutions(combinations, number, sources, targets, surfaces, ray_scene.object_of_face, tried)
