"""Trace a scene: the complex response of every array element to every transmitter position.

By reciprocity the gateway's elements are the sources and the transmitters the targets: the gateway never moves, so
one search for paths serves many transmitters. Every element is traced at its true position: indoors a half-metre
array at 915 MHz is in the near field, and one point with plane-wave phases (``synthetic_array``) is not good enough.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float

from scenes.description import Scene
from scenes.errors import InputError
from simulate.chains import Chains, find_chains, paths_of_chains, solve_chains
from simulate.paths import courses, fields, refine, shoot
from simulate.planes import Planes
from simulate.propagation import Propagation
from simulate.ray_tracer import PathsBuffer
from simulate.sionna_scene import Antennas, build_scene, gateway_antennas, transmitter_antennas

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


class Tracer:
    """A scene made ready for tracing.

    Where all paths are chains of reflections and refractions, the chains are found once, here, and ``responses``
    solves them exactly (``method`` is "chains"). Diffuse reflection and diffraction take Sionna's general way, which
    shoots rays from every element for each batch of transmitters ("shooting").

    Args:
        scene: where to trace.
        propagation: what to follow.
        region: lowest and highest corner of the box all transmitters are in, metres; the scene's if None.
        report: takes sentences on the progress of finding chains.
        found: chains found before, by a tracer made with the same arguments; searched for if None.

    Raises:
        InputError: libLLVM is missing or too old, or so many rays that one transmitter's paths exceed the memory.
    """

    def __init__(
        self,
        scene: Scene,
        propagation: Propagation,
        region: Float[np.ndarray, "2 3"] | None = None,
        report: Callable[[str], None] = lambda sentence: None,
        found: Chains | None = None,
    ):
        self.scene, self.propagation = scene, propagation
        self._sionna = build_scene(scene)
        self._sources = gateway_antennas(scene)
        self.method = "chains" if propagation.chains_suffice else "shooting"
        if propagation.chains_suffice:
            identifiers = [int(self._sionna.objects[item.name].object_id) for item in scene.objects]
            self._planes = Planes(scene, identifiers)
            self._identifiers = np.array(identifiers)
            if found is not None:
                self._chains = found.renamed(self._identifiers)
            else:
                if region is None:
                    region = np.array([scene.transmitter.region_min, scene.transmitter.region_max])
                self._chains = find_chains(self._sionna, self._planes, scene, region, propagation, report)
        else:
            candidates = propagation.rays * max(1, propagation.max_depth) * len(self._sources)
            self._at_once = MEMORY // (BYTES_PER_CANDIDATE * candidates)
            if not self._at_once:
                most = MEMORY // (BYTES_PER_CANDIDATE * max(1, propagation.max_depth) * len(self._sources))
                raise InputError(
                    f"with diffuse reflection or diffraction every ray may become a path: expected at most {most:,} "
                    f"rays at depth {propagation.max_depth}, found {propagation.rays:,} (--rays)"
                )

    @property
    def chains(self) -> Chains | None:
        """The chains found, with the scene's objects by their index; None where rays are shot instead."""
        if self.method != "chains":
            return None
        index = np.zeros(self._identifiers.max() + 1, dtype=np.int64)
        index[self._identifiers] = np.arange(len(self._identifiers))
        return self._chains.renamed(index)

    def responses(self, positions: Float[np.ndarray, "K 3"]) -> Complex[np.ndarray, "K elements"]:
        """Element responses y_m = Σ_paths a e^{-j2πfτ} to a transmitter at each position, complex64.

        a contains the free-space factor λ/4π, so that |y_m|² is the channel gain. The responses to one position do
        not depend on the others.

        Args:
            positions: metres, world frame.
        """
        targets = transmitter_antennas(self.scene, positions)
        result = np.zeros((len(targets), len(self._sources)), np.complex128)
        if self.method == "chains":
            arguments = self._sionna, self._planes, self._chains, self._sources, targets, self.propagation
            for _, paths in paths_of_chains(*arguments):
                paths.add_to(result)
            return result.astype(np.complex64)
        for start in range(0, len(targets), self._at_once):
            part = np.arange(start, min(start + self._at_once, len(targets)))
            some = targets.some(part)
            buffer = self._shot(self._sources, some)
            fields(self._sionna, buffer, self._sources, some, self.propagation).add_to(result[part[0] : part[-1] + 1])
        return result.astype(np.complex64)

    def paths(self, position: Float[np.ndarray, " 3"]) -> list[TracedPath]:
        """The paths to one position from one element (the first of those nearest the array's centre), strongest first.

        Args:
            position: metres, world frame.
        """
        offsets = self._sources.positions - np.asarray(self.scene.gateway.position)
        element = self._sources.some(np.argmin(np.linalg.norm(offsets, axis=1).round(6), keepdims=True))
        target = transmitter_antennas(self.scene, np.asarray(position)[None])
        if self.method == "chains":
            arguments = self._sionna, self._planes, self._chains, element, target, self.propagation
            buffers = [buffer for _, buffer in solve_chains(*arguments)]
        else:
            buffers = [self._shot(element, target)]
        found = []
        for buffer in buffers:
            responses = fields(self._sionna, buffer, element, target, self.propagation).responses
            vertices = courses(buffer, element, target)
            found += [TracedPath(*each) for each in zip(vertices, responses, strict=True)]
        return sorted(found, key=lambda path: -abs(path.response))

    def _shot(self, sources: Antennas, targets: Antennas) -> PathsBuffer:
        """Valid paths by shooting rays from every source."""
        room = self.propagation.rays * max(1, self.propagation.max_depth) * len(targets)
        buffer = shoot(self._sionna, sources, targets, self.propagation, room)
        buffer = refine(self._sionna, buffer, sources, targets, self.propagation)
        buffer.discard_invalid()
        return buffer
