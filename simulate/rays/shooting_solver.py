"""Paths as Sionna RT finds them: rays are shot from every element anew for each batch of transmitters."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from jaxtyping import Int

from scenes.files.errors import ParameterError
from simulate.rays.core.ray_scene import RayScene
from simulate.rays.core.ray_tracer import PathsBuffer
from simulate.rays.core.sionna_paths import fields, refine, shoot, terms, with_materials_of
from simulate.rays.core.sionna_scene import Antennas
from simulate.rays.core.terms import Paths, Terms

MEMORY = 2_000_000_000
"""Most bytes of candidate paths where rays are shot for each batch of transmitters."""

BYTES_PER_CANDIDATE = 250


class ShootingSolver:
    """The paths between antennas that shooting and bouncing rays find in a scene.

    Rays may find other paths for one source alone than for several together.
    """

    chains = 1

    def __init__(self, ray_scene: RayScene, sources: int, seed: int):
        self._ray_scene, self._seed = ray_scene, seed
        propagation = ray_scene.propagation
        bytes_per_ray = BYTES_PER_CANDIDATE * max(1, propagation.max_depth) * sources
        self._batch_size = MEMORY // (bytes_per_ray * propagation.rays)
        if not self._batch_size:
            raise ParameterError(
                "rays",
                f"expected at most {MEMORY // bytes_per_ray:,} rays at depth {propagation.max_depth}, since with "
                f"Sionna's path solver every ray may become a path, found {propagation.rays:,}",
            )

    def paths(self, sources: Antennas, targets: Antennas) -> Iterator[tuple[Int[np.ndarray, " paths"], Paths]]:
        """The paths between all sources and targets, in batches: the chain 0 for each path, and the paths."""
        for start, batch, buffer in self._shot(sources, targets):
            paths = fields(self._ray_scene, buffer, sources, batch)
            yield np.zeros(len(paths.targets), np.int64), paths._replace(targets=paths.targets + start)

    def terms(self, sources: Antennas, targets: Antennas) -> Iterator[Terms]:
        """The paths of ``paths``, with their vertices, also those of transmissions."""
        for start, batch, buffer in self._shot(sources, targets):
            found = terms(self._ray_scene, buffer, sources, batch)
            yield found._replace(targets=found.targets + start)

    def paths_in(self, others: Sequence[RayScene], sources: Antennas, targets: Antennas) -> Iterator[tuple[int, Paths]]:
        """The same paths in scenes of other materials, in batches: index of the scene, and the paths in it."""
        for start, batch, buffer in self._shot(sources, targets):
            for index, other in enumerate(others):
                paths = fields(other, with_materials_of(buffer, self._ray_scene, other), sources, batch)
                yield index, paths._replace(targets=paths.targets + start)

    def _shot(self, sources: Antennas, targets: Antennas) -> Iterator[tuple[int, Antennas, PathsBuffer]]:
        """The valid paths that rays from every source find, in batches: index of the first target, targets, paths."""
        propagation = self._ray_scene.propagation
        for start in range(0, len(targets), self._batch_size):
            batch = targets.subset(np.arange(start, min(start + self._batch_size, len(targets))))
            most_paths = propagation.rays * max(1, propagation.max_depth) * len(batch)
            buffer = shoot(self._ray_scene, sources, batch, self._seed, most_paths)
            buffer = refine(self._ray_scene, buffer, sources, batch)
            buffer.discard_invalid()
            yield start, batch, buffer
