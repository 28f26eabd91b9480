"""Find the chains with diffractions that carry power from the gateway into a region, and solve them.

Rays from the elements, and from positions in the region, find the sequences of planes that reflect waves. A sequence
after which a wave can reach an edge is an arm. Two arms at one edge, or at two edges that a link joins, make a
candidate. A candidate is kept if it carries power to one of some trial positions.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np
from jaxtyping import Float, Int

from simulate.positions.placement import free_positions
from simulate.rays.core.electric_field import AtEdge, path_amplitudes
from simulate.rays.core.multipath import Course, Interaction, Solution, largest_shares
from simulate.rays.core.ray_scene import RayScene
from simulate.rays.core.reflection_chains import Chains, plane_sequences, reflected
from simulate.rays.core.sionna_scene import Antennas, gateway_antennas, transmitter_antennas
from simulate.rays.core.surfaces import Surfaces
from simulate.rays.diffraction.arms import Arms, ends_of, reaches
from simulate.rays.diffraction.chain_geometry import Combinations, PathGeometry
from simulate.rays.diffraction.diffraction_chains import NO_LINK, NO_LINKS, DiffractedChains, chains_of, links_between
from simulate.rays.diffraction.edge_fields import behind_edge
from simulate.rays.diffraction.edges import Edges, diffracting_edges, foremost
from simulate.spectra.spectrum import evenly

MOST_REFLECTIONS = 2
"""Most reflections before and after an edge together. With a third one, spectra came no nearer to full wave."""

MOST_REFLECTIONS_TWICE = 1  # Most reflections of a chain with two diffractions

TRIALS = 64
"""Number of positions in the region from which rays are shot, and at which candidates are tried."""

ELEMENTS = 4
"""Number of elements at which candidates with two diffractions are tried. Those with one are tried at all elements."""

NEGLIGIBLE = 5e-5
"""A chain is dropped if its share of the power is smaller than this at every trial and every element."""


def find_diffracted_chains(
    edge_scene: EdgeScene,
    reflecting: Chains,
    region: Float[np.ndarray, "2 3"],
    seed: int,
    report: Callable[[str], None],
) -> DiffractedChains:
    """Find the chains with diffractions that carry power from the gateway to anywhere in a region."""
    ray_scene = edge_scene.ray_scene
    scene, propagation = ray_scene.description, ray_scene.propagation
    generator = np.random.default_rng(seed)
    elements = gateway_antennas(scene)
    trials = transmitter_antennas(scene, free_positions(scene, region, TRIALS, generator))
    most = max(0, min(MOST_REFLECTIONS, propagation.max_depth - 1)) if propagation.specular else 0

    def arms(antennas: Float[np.ndarray, "antennas 3"]) -> Arms:
        sequences = plane_sequences(ray_scene, antennas, most, generator)
        return _possible_arms(edge_scene, sequences, antennas)

    links = links_between(edge_scene.edges, ray_scene) if propagation.max_depth >= 2 else NO_LINKS
    most_twice = max(0, min(MOST_REFLECTIONS_TWICE, propagation.max_depth - 2, most))
    candidates = chains_of(arms(elements.positions), arms(trials.positions), links, (most, most_twice))
    is_double = candidates.link != NO_LINK
    some = elements.subset(evenly(np.arange(len(elements)), ELEMENTS))
    kept = _shares(edge_scene, candidates, reflecting, some, trials) >= NEGLIGIBLE
    kept[~is_double] = _shares(edge_scene, candidates.subset(~is_double), reflecting, elements, trials) >= NEGLIGIBLE
    chains = candidates.subset(kept)
    twice = int((chains.link != NO_LINK).sum())
    if edge_scene.left_out:
        report(f"the {edge_scene.left_out} least important edges are left out")
    report(
        f"{len(edge_scene.edges)} edges: {len(chains) - twice} chains with a diffraction and {twice} with two, of "
        f"{len(candidates)} tried"
    )
    return chains


def _shares(
    edge_scene: EdgeScene, chains: DiffractedChains, reflecting: Chains, sources: Antennas, targets: Antennas
) -> Float[np.ndarray, " chains"]:
    """The largest share of the power between a source and a target that each chain carries."""
    others = np.zeros((len(targets), len(sources)))
    for solution in reflected(edge_scene.ray_scene, reflecting, sources, targets, [edge_scene.surfaces]):
        _, paths = solution.arriving()
        np.add.at(others, (paths.targets, paths.sources), np.abs(paths.responses) ** 2)
    solutions = diffracted(edge_scene, chains, sources, targets, [edge_scene.surfaces])
    return largest_shares(solutions, len(chains), others)


def _possible_arms(
    edge_scene: EdgeScene, sequences: Int[np.ndarray, "sequences most"], antennas: Float[np.ndarray, "antennas 3"]
) -> Arms:
    """The sequences of reflections after which the wave of some antenna reaches an edge."""
    planes, edges = edge_scene.ray_scene.planes, edge_scene.edges
    found = [Arms(sequences[:0], np.zeros(0, np.int64))]
    for edge in range(len(edges)):
        arms = Arms(sequences, np.full(len(sequences), edge))
        found.append(arms.subset(reaches(planes, edges, arms, ends_of(planes, edges, arms, antennas))))
    return Arms(np.concatenate([arms.planes for arms in found]), np.concatenate([arms.edges for arms in found]))


LANES = 400_000  # Paths solved at a time. This bounds the memory.

AT_ONCE = 50_000_000  # Combinations of target, chain and source examined at a time, one byte each


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
    """Solve every chain between every source and target, in the order of shapes, then target, chain and source."""
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
                    path_amplitudes(each, sources, targets, geometry, _at_edges(each, edges, geometry, int(shape[0])))
                    for each in surfaces
                ]
                starts, ends = sources.positions[source], targets.positions[target]
                course = partial(_course, geometry, starts, ends, edge_scene, int(shape[0]), int(shape[1]))
                wavelengths = [each.wavelength for each in surfaces]
                yield Solution(number[chain], target, source, geometry.travelled, amplitudes, wavelengths, course)


def _at_edges(surfaces: Surfaces, edges: Edges, geometry: PathGeometry, first_edge: int) -> dict[int, AtEdge]:
    """What happens to the field at each edge of paths, by its number among the interactions."""
    numbers = range(len(geometry.edges))
    return {first_edge + number: partial(behind_edge, surfaces, edges, geometry, number) for number in numbers}


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
    return vertices, objects, kinds
