"""Sionna RT's own paths: rays are shot anew for each batch of transmitters. All code that uses its internals is here.

``PathSolver`` works in three steps. A generator shoots rays to find candidate chains of interactions. The image method
turns each candidate into an exact path or discards it. The field calculator gives the path's coefficient and delay. We
call these steps one by one, so that other materials can be tried on the same paths.

Sionna RT is pinned to 2.2.0 because of this file. tests/simulate/rays/test_sionna_solver.py compares the results
with those of the public ``PathSolver``.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from copy import copy
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int, UInt32

from scenes.files.errors import ParameterError
from simulate.rays.core.multipath import STRAIGHT, Multipath, Paths
from simulate.rays.core.ray_scene import RayScene
from simulate.rays.core.ray_tracer import (
    FieldCalculator,
    ImageMethod,
    PathsBuffer,
    SBDeterministicCandidateGenerator,
    dr,
    mi,
    rt,
)
from simulate.rays.core.sionna_scene import Antennas

MEMORY = 2_000_000_000
"""Most bytes of candidate paths where rays are shot for each batch of transmitters."""

BYTES_PER_CANDIDATE = 250


class ShootingSolver:
    """The paths that rays find in a scene; for one source alone they may be others than for several together."""

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
            paths = path_responses(self._ray_scene, buffer, sources, batch)
            yield np.zeros(len(paths.targets), np.int64), paths._replace(targets=paths.targets + start)

    def multipath(self, sources: Antennas, targets: Antennas) -> Iterator[Multipath]:
        """The paths of ``paths``, with their vertices, also those of transmissions."""
        for start, batch, buffer in self._shot(sources, targets):
            found = multipath(self._ray_scene, buffer, sources, batch)
            yield found._replace(targets=found.targets + start)

    def paths_in(self, others: Sequence[RayScene], sources: Antennas, targets: Antennas) -> Iterator[tuple[int, Paths]]:
        """The same paths in scenes of other materials, in batches: index of the scene, and the paths in it."""
        for start, batch, buffer in self._shot(sources, targets):
            for index, other in enumerate(others):
                paths = path_responses(other, with_materials_of(buffer, self._ray_scene, other), sources, batch)
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


SPECULAR = int(rt.InteractionType.SPECULAR)
REFRACTION = int(rt.InteractionType.REFRACTION)
NONE = int(rt.InteractionType.NONE)


@dataclass(frozen=True)
class Interactions:
    """Chains of interactions, from source to target. Unused depths at the end hold ``NONE``."""

    types: UInt32[np.ndarray, "n depth"]  # Sionna's ``InteractionType`` of each interaction
    shapes: UInt32[np.ndarray, "n depth"]  # Sionna's identifier of the object
    triangles: UInt32[np.ndarray, "n depth"]  # index of the triangle in the object


def shoot(ray_scene: RayScene, sources: Antennas, targets: Antennas, seed: int, most_paths: int) -> PathsBuffer:
    """Find candidate paths to the targets by shooting and bouncing rays from the sources."""
    propagation = ray_scene.propagation
    buffer = SBDeterministicCandidateGenerator()(
        mi_scene=ray_scene.sionna.mi_scene,
        src_positions=sources.points,
        tgt_positions=targets.points,
        samples_per_src=propagation.rays,
        max_num_paths_per_src=most_paths,
        max_depth=propagation.max_depth,
        los=propagation.los,
        specular_reflection=propagation.specular,
        diffuse_reflection=propagation.sionna_diffuse,
        refraction=propagation.refraction,
        diffraction=propagation.sionna_diffraction,
        edge_diffraction=False,
        seed=seed,
    )
    buffer.schedule()
    dr.eval()
    buffer.shrink()
    return buffer


def refine(ray_scene: RayScene, buffer: PathsBuffer, sources: Antennas, targets: Antennas) -> PathsBuffer:
    """Turn candidates into exact paths by the image method."""
    return ImageMethod()(
        scene=ray_scene.sionna.mi_scene,
        paths=buffer,
        diffraction=ray_scene.propagation.sionna_diffraction,
        diffraction_lit_region=True,
        src_positions=sources.points,
        tgt_positions=targets.points,
    )


def interactions_of(buffer: PathsBuffer) -> Interactions:
    """The buffer's chains as arrays. After ``refine`` these are the surfaces that the valid paths really hit."""
    return Interactions(buffer.interaction_types.numpy(), buffer.shapes.numpy(), buffer.primitives.numpy())


def multipath(ray_scene: RayScene, buffer: PathsBuffer, sources: Antennas, targets: Antennas) -> Multipath:
    """The contribution and the vertices of each valid path, in the order of ``path_responses``."""
    paths = path_responses(ray_scene, buffer, sources, targets)
    hit = interactions_of(buffer)
    starts, ends = sources.positions[paths.sources][:, None], targets.positions[paths.targets][:, None]
    happened, turned = hit.types != NONE, (hit.types != NONE) & (hit.types != REFRACTION)
    vertices = np.concatenate([starts, np.where(happened[..., None], _vertices(buffer), ends), ends], axis=1)
    objects = np.full(hit.types.shape, STRAIGHT)
    objects[turned] = ray_scene.object_of_identifier[hit.shapes[turned]]
    return Multipath(paths.targets, paths.sources, paths.responses, vertices, objects, hit.types.astype(np.int64))


def path_responses(ray_scene: RayScene, buffer: PathsBuffer, sources: Antennas, targets: Antennas) -> Paths:
    """The complex response that each valid path of the buffer contributes."""
    if buffer.buffer_size == 0:
        nothing = np.zeros(0, np.int64)
        return Paths(nothing, nothing, np.zeros(0, np.complex128))
    buffer = FieldCalculator()(
        wavelength=ray_scene.sionna.wavelength,
        paths=buffer,
        samples_per_src=ray_scene.propagation.rays,
        diffraction=ray_scene.propagation.sionna_diffraction,
        src_positions=sources.points,
        tgt_positions=targets.points,
        src_orientations=sources.orientations,
        tgt_orientations=targets.orientations,
        src_antenna_patterns=[sources.pattern],
        tgt_antenna_patterns=[targets.pattern],
    )
    coefficient = buffer.a[0][0]
    amplitude = np.where(buffer.valid.numpy(), coefficient.real.numpy() + 1j * coefficient.imag.numpy(), 0)
    # Across a room fτ is some tens of periods, so single precision would lose digits of the phase.
    periods = float(ray_scene.sionna.frequency[0]) * buffer.tau.numpy().astype(np.float64)
    response = amplitude * np.exp(-2j * np.pi * periods)
    return Paths(buffer.target_indices.numpy(), buffer.source_indices.numpy(), response)


def with_materials_of(buffer: PathsBuffer, ray_scene: RayScene, other: RayScene) -> PathsBuffer:
    """The buffer's paths in another scene that differs only in its materials."""
    hit = interactions_of(buffer)
    happened = hit.types != NONE
    shapes = hit.shapes.copy()
    shapes[happened] = other.identifiers[ray_scene.object_of_identifier[hit.shapes[happened]]]
    found = copy(buffer)
    found.valid, found._shapes = mi.Bool(buffer.valid), mi.TensorXu(shapes)  # type: ignore[operator]
    return found


def _vertices(buffer: PathsBuffer) -> Float[np.ndarray, "paths depth 3"]:
    """Places of the interactions on each path of the buffer, metres, world frame."""
    axes = buffer.vertices_x, buffer.vertices_y, buffer.vertices_z
    return np.stack([axis.numpy() for axis in axes], axis=-1).astype(float)
