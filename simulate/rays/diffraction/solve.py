"""Solve chains with diffractions between all sources and targets."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np
from jaxtyping import Float

from simulate.rays.core.ray_scene import RayScene
from simulate.rays.core.sionna_scene import Antennas
from simulate.rays.core.solution import Course, Solution
from simulate.rays.core.surfaces import Surfaces
from simulate.rays.core.terms import Interaction
from simulate.rays.diffraction.chain_geometry import Combinations, PathGeometry
from simulate.rays.diffraction.diffraction_chains import DiffractedChains
from simulate.rays.diffraction.edges import Edges, diffracting_edges, foremost
from simulate.rays.diffraction.ends import ends_of
from simulate.rays.diffraction.fields import diffracted_amplitudes

LANES = 400_000
"""Paths solved at a time. This bounds the memory."""

AT_ONCE = 50_000_000
"""Combinations of target, chain and source examined at a time, one byte each."""


class EdgeScene:
    """A scene with its edges."""

    def __init__(self, ray_scene: RayScene, edges: Edges | None = None):
        self.ray_scene = ray_scene
        every = diffracting_edges(ray_scene) if edges is None else edges
        self.edges: Edges = foremost(every, ray_scene.description)
        self.left_out = len(every) - len(self.edges)
        self.surfaces = Surfaces(ray_scene)


def diffracted(
    edge_scene: EdgeScene,
    chains: DiffractedChains,
    sources: Antennas,
    targets: Antennas,
    surfaces: Sequence[Surfaces],
) -> Iterator[Solution]:
    """Solve every chain between every source and target.

    The paths are ordered by the shapes of their chains (numbers of reflections, diffractions, reflections), then by
    target, chain and source.
    """
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
                target, chain, source = paths[0] + start, paths[1], paths[2]
                amplitudes = [
                    diffracted_amplitudes(each, edges, sources, targets, geometry, int(shape[0])) for each in surfaces
                ]
                starts, ends = sources.positions[source], targets.positions[target]
                course = partial(_course, geometry, starts, ends, edge_scene, int(shape[0]), int(shape[1]))
                wavelengths = [each.wavelength for each in surfaces]
                yield Solution(number[chain], target, source, geometry.travelled, amplitudes, wavelengths, course)


def _course(
    geometry: PathGeometry,
    starts: Float[np.ndarray, "paths 3"],
    ends: Float[np.ndarray, "paths 3"],
    edge_scene: EdgeScene,
    before: int,
    diffractions: int,
) -> Course:
    """Where paths run that are diffracted after some number of reflections."""
    objects_of = edge_scene.ray_scene.object_of_face
    objects = objects_of[geometry.faces].T
    at_edges = slice(before, before + diffractions)
    objects[:, at_edges] = objects_of[edge_scene.edges.faces[geometry.edges]].T
    kinds = np.full(objects.shape, int(Interaction.REFLECTION))
    kinds[:, at_edges] = Interaction.DIFFRACTION
    vertices = np.concatenate([starts[:, None], geometry.vertices.transpose(2, 0, 1), ends[:, None]], axis=1)
    return Course(vertices, objects, kinds)
