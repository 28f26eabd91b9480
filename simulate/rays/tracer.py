"""Trace a scene: the complex response of every array element to every transmitter position.

By reciprocity the gateway's elements are the sources and the transmitters the targets: the gateway never moves, so
one search for paths serves many transmitters. Every element is traced at its true position: indoors a half-metre
array at 915 MHz is in the near field, where one point with plane-wave phases (``synthetic_array``) is inaccurate.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float, Int

from scenes.files.errors import ParameterError
from scenes.scene.description import Scene
from simulate.rays.core.propagation import Propagation
from simulate.rays.core.ray_scene import RayScene
from simulate.rays.core.ray_tracer import PathsBuffer
from simulate.rays.core.reflection_chains import Chains, find_chains, solve_chains
from simulate.rays.core.sionna_paths import Paths, fields, refine, shoot, terms, with_materials_of
from simulate.rays.core.sionna_scene import Antennas, gateway_antennas, transmitter_antennas
from simulate.rays.core.surfaces import Surfaces
from simulate.rays.core.terms import Terms
from simulate.rays.diffraction.diffraction_chains import DiffractedChains
from simulate.rays.diffraction.edges import Edges
from simulate.rays.diffraction.search import find_diffracted_chains
from simulate.rays.diffraction.solve import EdgeScene, diffracted_paths, diffracted_paths_with, diffracted_terms
from simulate.rays.scattering.scattered import Scattering

MEMORY = 2_000_000_000
"""Bytes that candidate paths may take where rays are shot for each batch of transmitters."""

BYTES_PER_CANDIDATE = 250


class TracedPath(NamedTuple):
    """A path between an element of the gateway and a transmitter.

    Attributes:
        vertices: element, interactions, transmitter; metres, world frame.
        response: a e^{-j2πfτ}.
    """

    vertices: Float[np.ndarray, "vertices 3"]
    response: complex


class Found(NamedTuple):
    """Chains that were found in a scene, for another tracer of the same scene and propagation.

    Attributes:
        reflected: of reflections and refractions, with the scene's objects by their index; None where rays are shot
            for every batch instead.
        diffracted: with diffractions; None where none are followed.
    """

    reflected: Chains | None
    diffracted: DiffractedChains | None


class Tracer:
    """A scene made ready for tracing.

    Chains of reflections, refractions and diffractions are found once, here, and ``responses`` solves them exactly
    (``method`` is "chains"); diffuse reflection is that of fixed patches. Sionna's general way instead shoots rays from
    every element for each batch of transmitters ("shooting").

    Args:
        scene: where to trace.
        propagation: the mechanisms to follow.
        region: lowest and highest corner of the box all transmitters are in, metres; the scene's if None.
        seed: seed of the rays and of the patches of rough surfaces.
        report: called with sentences on the progress of finding chains.
        found: chains found before, by a tracer made with the same arguments; searched for if None.

    Attributes:
        ray_scene: the scene in the ray tracer's form.
        elements: the gateway's elements.
        method: "chains" or "shooting".

    Raises:
        InputError: libLLVM is missing or too old.
        ParameterError: so many rays that one transmitter's paths exceed the memory.

    >>> import bisplat
    >>> floor = bisplat.SceneObject("floor", bisplat.shapes.sheet((-5, -5, 0), (10, 0, 0), (0, 10, 0)), "concrete")
    >>> gateway = bisplat.Gateway(position=(0, 0, 1.5), orientation=bisplat.facing((-1, 0, 0)))
    >>> region = bisplat.Transmitter(region_min=(-4, -1, 0.5), region_max=(-2, 1, 2))
    >>> materials = bisplat.p2040_materials(["concrete"], 915e6)
    >>> yard = bisplat.Scene("yard", 915e6, gateway, region, (floor,), materials)
    >>> tracer = Tracer(yard, Propagation(max_depth=1, rays=10_000))
    >>> tracer.responses(np.array([[-3.0, 0.0, 1.0]])).shape, len(tracer.paths(np.array([-3.0, 0.0, 1.0])))
    ((1, 16), 2)
    """

    def __init__(
        self,
        scene: Scene,
        propagation: Propagation,
        region: Float[np.ndarray, "2 3"] | None = None,
        seed: int = 1,
        report: Callable[[str], None] = lambda sentence: None,
        found: Found | None = None,
    ):
        self.ray_scene = RayScene.of(scene, propagation)
        self.elements = gateway_antennas(scene)
        self._seed = seed
        self.method = "shooting" if propagation.sionna else "chains"
        region = scene.transmitter.region if region is None else region
        if self.method == "chains":
            if found is not None and found.reflected is not None:
                self._chains = found.reflected.renamed(self.ray_scene.identifiers)
            else:
                self._chains = find_chains(self.ray_scene, region, seed, report)
        else:
            bytes_per_ray = BYTES_PER_CANDIDATE * max(1, propagation.max_depth) * len(self.elements)
            self._batch_size = MEMORY // (bytes_per_ray * propagation.rays)
            if not self._batch_size:
                raise ParameterError(
                    "rays",
                    f"expected at most {MEMORY // bytes_per_ray:,} rays at depth {propagation.max_depth}, since in "
                    "Sionna's way every ray may become a path, found "
                    f"{propagation.rays:,}",
                )
        self._diffracted: DiffractedChains | None = None
        own = self.method == "chains" and propagation.max_depth > 0
        self._scattering = Scattering(self.ray_scene, seed) if own and propagation.diffuse else None
        if own and propagation.diffraction:
            self._edge_scene = EdgeScene(self.ray_scene)
            self._diffracted = found.diffracted if found is not None else None
            if self._diffracted is None:
                self._diffracted = find_diffracted_chains(self._edge_scene, region, seed, report)

    @property
    def found(self) -> Found:
        """The chains found, for ``Tracer(found=...)``."""
        if self.method != "chains":
            return Found(None, self._diffracted)
        return Found(self._chains.renamed(self.ray_scene.object_of_identifier), self._diffracted)

    @property
    def edges(self) -> Edges | None:
        """The edges that diffract; None where diffraction is not followed."""
        return None if self._diffracted is None else self._edge_scene.edges

    @property
    def chains(self) -> int:
        """Number of chains; those without diffraction come first. Shot rays all count as one chain."""
        if self.method != "chains":
            return 1
        return len(self._chains) + (0 if self._diffracted is None else len(self._diffracted))

    def responses(
        self, positions: Float[np.ndarray, "K 3"], factors: Complex[np.ndarray, " chains"] | None = None
    ) -> Complex[np.ndarray, "K elements"]:
        """Element responses y_m = Σ_paths a e^{-j2πfτ} to a transmitter at each position, complex64.

        a contains the free-space factor λ/4π, so that |y_m|² is the channel gain. The responses to one position do
        not depend on the others.

        Args:
            positions: metres, world frame.
            factors: factor of the paths of each chain; 1 if None. Diffuse reflection has none.

        Returns:
            The responses, un-normalised.
        """
        result = np.zeros((len(positions), len(self.elements)), np.complex128)
        for start, chain, paths in self._found(self.elements, positions):
            if factors is not None:
                paths = replace(paths, responses=paths.responses * factors[chain])
            paths.add_to(result[start:])
        if self._scattering is not None:
            result += self._scattering.responses(self.elements, self._targets(positions))
        return result.astype(np.complex64)

    def responses_with(
        self, others: Sequence[Scene], positions: Float[np.ndarray, "K 3"]
    ) -> Complex[np.ndarray, "others K elements"]:
        """``responses`` of other scenes, complex64, without that of patches; their paths are found only once.

        Args:
            others: scenes that differ from this one in nothing but the properties of their materials and the
                thicknesses of their objects; the same objects are conductors.
            positions: metres, world frame.
        """
        scenes = [RayScene.of(each, self.ray_scene.propagation) for each in others]
        result = np.zeros((len(scenes), len(positions), len(self.elements)), np.complex128)
        for start, targets, _, buffer in self._solved(self.elements, positions):
            for total, scene in zip(result, scenes, strict=True):
                same = with_materials_of(buffer, self.ray_scene, scene)
                fields(scene, same, self.elements, targets).add_to(total[start:])
        if self._diffracted is not None:
            surfaces, targets = [Surfaces(each) for each in scenes], self._targets(positions)
            for found in diffracted_paths_with(self._edge_scene, self._diffracted, self.elements, targets, surfaces):
                for total, paths in zip(result, found, strict=True):
                    paths.add_to(total)
        return result.astype(np.complex64)

    def responses_by_chain(self, positions: Float[np.ndarray, "K 3"]) -> Complex[np.ndarray, "K elements chains"]:
        """The part of each chain in ``responses``, complex64; diffuse reflection is in none.

        Args:
            positions: metres, world frame.
        """
        result = np.zeros((len(positions), len(self.elements), self.chains), np.complex64)
        for start, chain, paths in self._found(self.elements, positions):
            np.add.at(result[start:], (paths.targets, paths.sources, chain), paths.responses)
        return result

    def path_counts(self, positions: Float[np.ndarray, "K 3"]) -> Int[np.ndarray, " K"]:
        """Number of paths between each position and the element of ``paths``, without those of diffuse reflection.

        Args:
            positions: metres, world frame.
        """
        result = np.zeros(len(positions), np.int64)
        for start, _, paths in self._found(self.middle, positions):
            np.add.at(result[start:], paths.targets, 1)
        return result

    @property
    def middle(self) -> Antennas:
        """One element, the first of those nearest the array's centre."""
        return self.elements.subset(np.array([self._middle_index]))

    @property
    def _middle_index(self) -> int:
        offsets = self.elements.positions - np.asarray(self.ray_scene.description.gateway.position)
        return int(np.argmin(np.linalg.norm(offsets, axis=1).round(6)))

    def _targets(self, positions: Float[np.ndarray, "K 3"]) -> Antennas:
        return transmitter_antennas(self.ray_scene.description, positions)

    def _solved(
        self, elements: Antennas, positions: Float[np.ndarray, "K 3"]
    ) -> Iterator[tuple[int, Antennas, Int[np.ndarray, " paths"], PathsBuffer]]:
        """Batches of paths that are not diffracted: index of the first transmitter, transmitters, chains, paths."""
        targets = self._targets(positions)
        if self.method == "chains":
            for chain, buffer in solve_chains(self.ray_scene, self._chains, elements, targets):
                yield 0, targets, chain, buffer
        else:
            for start in range(0, len(targets), self._batch_size):
                batch = targets.subset(np.arange(start, min(start + self._batch_size, len(targets))))
                buffer = self._shot(elements, batch)
                yield start, batch, np.zeros(buffer.buffer_size, np.int64), buffer

    def _found(
        self, elements: Antennas, positions: Float[np.ndarray, "K 3"]
    ) -> Iterator[tuple[int, Int[np.ndarray, " paths"], Paths]]:
        """Batches of paths: index of the position that is target 0 of the batch, each path's chain, the paths."""
        for start, targets, chain, buffer in self._solved(elements, positions):
            yield start, chain, fields(self.ray_scene, buffer, elements, targets)
        if self._diffracted is not None:
            first, targets = self.chains - len(self._diffracted), self._targets(positions)
            for chain, paths in diffracted_paths(self._edge_scene, self._diffracted, elements, targets):
                yield 0, first + chain, paths

    def paths(self, position: Float[np.ndarray, " 3"]) -> list[TracedPath]:
        """The paths between one position and one element, the first of those nearest the array's centre.

        Args:
            position: metres, world frame.

        Returns:
            The paths, strongest first.
        """
        found = []
        for batch in self.middle_terms(np.asarray(position)[None]):
            for vertices, response in zip(batch.vertices, batch.responses, strict=True):
                moved = np.append(True, (np.diff(vertices, axis=0) != 0).any(axis=1))
                found.append(TracedPath(vertices[moved], response))
        return sorted(found, key=lambda path: -abs(path.response))

    def terms(self, positions: Float[np.ndarray, "K 3"]) -> Iterator[Terms]:
        """Batches of the paths whose sum ``responses`` returns, but for those of diffuse reflection.

        Args:
            positions: metres, world frame.
        """
        return self._terms(self.elements, positions)

    def middle_terms(self, positions: Float[np.ndarray, "K 3"]) -> Iterator[Terms]:
        """Batches of the paths whose sum ``responses`` returns for the element of ``paths``, the only source here.

        Args:
            positions: metres, world frame.
        """
        if self.method == "shooting":  # which chains an element's rays find depends on the other elements'
            for batch in self.terms(positions):
                chosen = batch.sources == self._middle_index
                batch = Terms(*(each[chosen] for each in batch))
                yield batch._replace(sources=np.zeros_like(batch.sources))
            return
        yield from self._terms(self.middle, positions)
        if self._scattering is not None:
            yield from self._scattering.terms(self.middle, self._targets(positions))

    def _terms(self, elements: Antennas, positions: Float[np.ndarray, "K 3"]) -> Iterator[Terms]:
        for start, targets, _, buffer in self._solved(elements, positions):
            found = terms(self.ray_scene, buffer, elements, targets)
            yield found._replace(targets=found.targets + start)
        if self._diffracted is not None:
            yield from diffracted_terms(self._edge_scene, self._diffracted, elements, self._targets(positions))

    def _shot(self, sources: Antennas, targets: Antennas) -> PathsBuffer:
        """Valid paths by shooting rays from every source."""
        propagation = self.ray_scene.propagation
        most_paths = propagation.rays * max(1, propagation.max_depth) * len(targets)
        buffer = shoot(self.ray_scene, sources, targets, self._seed, most_paths)
        buffer = refine(self.ray_scene, buffer, sources, targets)
        buffer.discard_invalid()
        return buffer
