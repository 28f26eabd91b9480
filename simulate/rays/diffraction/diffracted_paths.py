"""The paths of chains with diffractions between sources and targets."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np
from jaxtyping import Float

from simulate.rays.core.electric_field import AtEdge, solved
from simulate.rays.core.image_method import batches, pieces
from simulate.rays.core.multipath import Interaction
from simulate.rays.core.ray_scene import RayScene
from simulate.rays.core.sionna_scene import Antennas
from simulate.rays.core.solution import Course, Solution
from simulate.rays.core.surfaces import Surfaces
from simulate.rays.diffraction.chain_geometry import Combinations, PathGeometry
from simulate.rays.diffraction.diffraction_chains import DiffractedChains
from simulate.rays.diffraction.diffraction_points import Wedge
from simulate.rays.diffraction.edge_fields import behind_edge
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
) -> Iterator[Solution]:
    """Solve every chain between every source and target, in the order of shapes, then target, chain and source."""
    mirrors, edges = edge_scene.ray_scene.mirrors, edge_scene.edges
    wavelengths = [each.wavelength for each in surfaces]
    shapes = chains.shapes
    for shape in np.unique(shapes, axis=0):
        number = np.nonzero((shapes == shape).all(axis=1))[0]
        before, diffractions = int(shape[0]), int(shape[1])
        alike = chains.subset(number)
        wavelength = edge_scene.ray_scene.description.wavelength
        combinations = Combinations(mirrors, edges, edge_scene.wedges, alike, sources.positions, wavelength)
        sheets = bool(edges.sheets[alike.edges].any())
        for start, stop in batches(len(targets), len(alike), len(sources)):
            some = targets.subset(slice(start, stop))
            far = combinations.ends_of(some.positions)
            possible = combinations.possible(far, len(some))
            for lane in pieces(possible):
                combination = combinations.combination(lane)
                geometry = combinations.ways(far, combination)
                at_edges = partial(_at_edges, edges, geometry, before, sheets)
                amplitudes = solved(surfaces, sources, some, geometry, at_edges)
                target, chain, source = (each.numpy().astype(np.int64) for each in combination)
                antennas = sources.positions[source], some.positions[target]
                course = partial(_course, geometry, *antennas, edge_scene, before, diffractions)
                yield Solution(
                    number[chain], start + target, source, geometry.travelled, amplitudes, wavelengths, course
                )


def _at_edges(
    edges: Edges, geometry: PathGeometry, first_edge: int, sheets: bool, surfaces: Surfaces
) -> dict[int, AtEdge]:
    """What happens to the field at each edge of paths, by its number among the interactions."""
    numbers = range(len(geometry.edges))
    return {first_edge + number: partial(behind_edge, surfaces, edges, sheets, geometry, number) for number in numbers}


def _course(
    geometry: PathGeometry,
    starts: Float[np.ndarray, "paths 3"],
    ends: Float[np.ndarray, "paths 3"],
    edge_scene: EdgeScene,
    before: int,
    diffractions: int,
) -> Course:
    """Where paths run that are diffracted after some number of reflections."""
    objects_of, edges = edge_scene.ray_scene.object_of_face, edge_scene.edges
    objects = np.stack([np.broadcast_to(objects_of[face.numpy()], len(starts)) for face in geometry.faces], axis=1)
    at_edges = slice(before, before + diffractions)
    objects[:, at_edges] = np.stack([objects_of[edges.faces[edge.numpy()]] for edge in geometry.edges], axis=1)
    kinds = np.full(objects.shape, int(Interaction.REFLECTION))
    kinds[:, at_edges] = Interaction.DIFFRACTION
    vertices = np.stack([starts, *[vertex.numpy().T for vertex in geometry.vertices], ends], axis=1)
    return vertices, objects, kinds
