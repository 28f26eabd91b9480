"""Solve chains with diffractions between all sources and targets."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from jaxtyping import Int

from simulate.rays.core.ray_scene import RayScene
from simulate.rays.core.sionna_scene import Antennas
from simulate.rays.core.surfaces import Surfaces
from simulate.rays.core.terms import Interaction, Paths, Terms
from simulate.rays.diffraction.chain_geometry import Combinations, PathGeometry
from simulate.rays.diffraction.diffraction_chains import DiffractedChains
from simulate.rays.diffraction.edges import Edges, diffracting_edges, foremost
from simulate.rays.diffraction.ends import ends_of
from simulate.rays.diffraction.fields import diffracted_responses

LANES = 400_000
"""Paths solved at a time. This bounds the memory."""

AT_ONCE = 50_000_000
"""Combinations of target, chain and source examined at a time, one byte each."""


class EdgeScene:
    """A scene with its edges.

    Args:
        ray_scene: the scene, with the propagation to follow.

    Attributes:
        ray_scene: the scene, with the propagation to follow.
        edges: the diffracting edges that are followed.
        left_out: number of edges that are not followed, since there are too many.
        surfaces: the materials of the scene's triangles.
    """

    def __init__(self, ray_scene: RayScene):
        self.ray_scene = ray_scene
        edges = diffracting_edges(ray_scene)
        self.edges: Edges = foremost(edges, ray_scene.description)
        self.left_out = len(edges) - len(self.edges)
        self.surfaces = Surfaces(ray_scene)


def diffracted_paths(
    edge_scene: EdgeScene, chains: DiffractedChains, sources: Antennas, targets: Antennas
) -> Iterator[tuple[Int[np.ndarray, " paths"], Paths]]:
    """Solve every chain between every source and target.

    The paths are ordered by the shapes of their chains (numbers of reflections, diffractions, reflections), then by
    target, chain and source. The paths of one target do not depend on the other targets.

    Args:
        edge_scene: the scene and its edges.
        chains: the chains to solve.
        sources: where the paths begin.
        targets: where they end.

    Yields:
        Batches of paths, and the index of each path's chain.
    """
    for chain, (paths,), _ in _solved(edge_scene, chains, sources, targets, [edge_scene.surfaces]):
        kept = paths.responses != 0
        yield chain[kept], Paths(paths.targets[kept], paths.sources[kept], paths.responses[kept])


def diffracted_paths_with(
    edge_scene: EdgeScene,
    chains: DiffractedChains,
    sources: Antennas,
    targets: Antennas,
    surfaces: Sequence[Surfaces],
) -> Iterator[list[Paths]]:
    """The paths of ``diffracted_paths``, with their responses for each of several sets of materials; 0 if blocked.

    Args:
        edge_scene: the scene and its edges.
        chains: the chains to solve.
        sources: where the paths begin.
        targets: where they end.
        surfaces: surfaces of the same scene with other materials, once for each set.
    """
    for _, paths, _ in _solved(edge_scene, chains, sources, targets, surfaces):
        yield paths


def diffracted_terms(
    edge_scene: EdgeScene, chains: DiffractedChains, sources: Antennas, targets: Antennas
) -> Iterator[Terms]:
    """The paths of ``diffracted_paths`` with their vertices, from the same arguments and in the same order."""
    objects_of = edge_scene.ray_scene.object_of_face
    for number, (paths,), geometry in _solved(edge_scene, chains, sources, targets, [edge_scene.surfaces]):
        kept = paths.responses != 0
        before, diffractions, _ = chains.shapes[number[0]]
        objects = objects_of[geometry.faces].T
        objects[:, before : before + diffractions] = objects_of[edge_scene.edges.faces[geometry.edges]].T
        kinds = np.full(objects.shape, int(Interaction.REFLECTION))
        kinds[:, before : before + diffractions] = Interaction.DIFFRACTION
        between = geometry.vertices.transpose(2, 0, 1)
        starts, ends = sources.positions[paths.sources][:, None], targets.positions[paths.targets][:, None]
        vertices = np.concatenate([starts, between, ends], axis=1)
        found = Terms(paths.targets, paths.sources, paths.responses, vertices, objects, kinds)
        yield Terms(*(each[kept] for each in found))


def _solved(
    edge_scene: EdgeScene,
    chains: DiffractedChains,
    sources: Antennas,
    targets: Antennas,
    surfaces: Sequence[Surfaces],
) -> Iterator[tuple[Int[np.ndarray, " paths"], list[Paths], PathGeometry]]:
    """Batches of paths, blocked or not: the chain of each path, the paths with each of the surfaces, and their ways."""
    planes, edges = edge_scene.ray_scene.planes, edge_scene.edges
    wavelength = edge_scene.ray_scene.description.wavelength
    shapes = chains.shapes
    for shape in np.unique(shapes, axis=0):
        number = np.nonzero((shapes == shape).all(axis=1))[0]
        alike = chains.subset(number)
        near = ends_of(planes, edges, alike.near, sources.positions)
        batch = max(1, AT_ONCE // (len(alike) * len(sources)))
        for start in range(0, len(targets), batch):
            far = ends_of(planes, edges, alike.far, targets.positions[start : start + batch])
            combinations = Combinations(planes, edges, alike, near, far, wavelength)
            possible = combinations.possible()
            for first in range(0, possible.shape[1], LANES):
                paths = possible[:, first : first + LANES]
                geometry = combinations.geometry(paths, start)
                found = [
                    Paths(paths[0] + start, paths[2], responses)
                    for responses in (
                        diffracted_responses(each, edges, sources, targets, geometry, int(shape[0]))
                        for each in surfaces
                    )
                ]
                yield number[paths[1]], found, geometry
