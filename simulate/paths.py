"""Everything that touches Sionna RT's internals: candidate chains in, element responses out.

``PathSolver`` is three steps: a generator shoots rays to find candidate chains of interactions, the image method
turns each candidate into an exact path or discards it, the field calculator gives its coefficient and delay. We call
the steps one by one, so that chains found once serve every element and transmitter (``simulate.chains``).

Sionna RT is pinned to 2.2.0 for this file; tests/simulate/test_paths.py compares it with the public ``PathSolver``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Float, Int, UInt32

from simulate.propagation import Propagation
from simulate.ray_tracer import FieldCalculator, ImageMethod, PathsBuffer, SBDeterministicCandidateGenerator, dr, mi, rt
from simulate.sionna_scene import Antennas

SPECULAR = int(rt.InteractionType.SPECULAR)
NONE = int(rt.InteractionType.NONE)


@dataclass(frozen=True)
class Interactions:
    """Chains of interactions, source to target; unused depths at the end hold ``NONE``.

    Attributes:
        types: Sionna's ``InteractionType`` of each.
        shapes: Sionna's object identifier.
        triangles: index of the object's triangle.
    """

    types: UInt32[np.ndarray, "n depth"]
    shapes: UInt32[np.ndarray, "n depth"]
    triangles: UInt32[np.ndarray, "n depth"]

    def __len__(self) -> int:
        return len(self.types)


def shoot(sionna: rt.Scene, sources: Antennas, targets: Antennas, propagation: Propagation, room: int) -> PathsBuffer:
    """Shoot and bounce rays from the sources: candidate paths to the targets, the same ones every time.

    Args:
        room: most candidates kept per source. Also, above a million, the size of the table in which Sionna tells
            new chains from known ones by their hash: two chains that collide in one table rarely do in another.
    """
    buffer = SBDeterministicCandidateGenerator()(
        mi_scene=sionna.mi_scene,
        src_positions=sources.points,
        tgt_positions=targets.points,
        samples_per_src=propagation.rays,
        max_num_paths_per_src=room,
        max_depth=propagation.max_depth,
        los=propagation.los,
        specular_reflection=propagation.specular,
        diffuse_reflection=propagation.diffuse,
        refraction=propagation.refraction,
        diffraction=propagation.diffraction,
        edge_diffraction=False,
        seed=propagation.seed,
    )
    buffer.schedule()
    dr.eval()
    buffer.shrink()
    return buffer


def candidates(
    interactions: Interactions,
    vertices: dict[int, np.ndarray],
    chain: Int[np.ndarray, " paths"],
    source: Int[np.ndarray, " paths"],
    target: Int[np.ndarray, " paths"],
) -> PathsBuffer:
    """Chains between sources and targets, as candidates for ``refine``.

    Args:
        vertices: for each object identifier, one vertex of each of its triangles, [triangles, 3], metres.
        chain: index into ``interactions`` of each path.
        source: index of its source.
        target: index of its target.
    """
    count, depth = interactions.types.shape
    on_plane = np.zeros((count, depth, 3), np.float32)
    for shape in np.unique(interactions.shapes[interactions.types == SPECULAR]):
        where = interactions.shapes == shape
        on_plane[where] = vertices[int(shape)][interactions.triangles[where]]

    buffer = PathsBuffer(len(chain), depth, diffraction=False)
    buffer._src_indices, buffer._tgt_indices = mi.UInt(source), mi.UInt(target)
    entries = dr.repeat(mi.UInt(chain), depth) * depth + dr.tile(dr.arange(mi.UInt, depth), len(chain))
    shape = (len(chain), depth)

    def spread(kind, tensor, table):
        return tensor(dr.gather(kind, kind(np.ascontiguousarray(table).ravel()), entries), shape=shape)

    buffer._interaction_types = spread(mi.UInt, mi.TensorXu, interactions.types)
    buffer._shapes = spread(mi.UInt, mi.TensorXu, interactions.shapes)
    buffer._primitives = spread(mi.UInt, mi.TensorXu, interactions.triangles)
    buffer._vertices_x = spread(mi.Float, mi.TensorXf, on_plane[..., 0])
    buffer._vertices_y = spread(mi.Float, mi.TensorXf, on_plane[..., 1])
    buffer._vertices_z = spread(mi.Float, mi.TensorXf, on_plane[..., 2])
    buffer.schedule()
    dr.eval()
    return buffer


def refine(
    sionna: rt.Scene, buffer: PathsBuffer, sources: Antennas, targets: Antennas, propagation: Propagation
) -> PathsBuffer:
    """Exact paths by the image method; candidates that are blocked or miss their surfaces are marked invalid."""
    return ImageMethod()(
        scene=sionna.mi_scene,
        paths=buffer,
        diffraction=propagation.diffraction,
        diffraction_lit_region=True,
        src_positions=sources.points,
        tgt_positions=targets.points,
    )


def interactions_of(buffer: PathsBuffer) -> Interactions:
    """The buffer's chains as arrays; after ``refine`` of valid paths: what was really hit."""
    return Interactions(buffer.interaction_types.numpy(), buffer.shapes.numpy(), buffer.primitives.numpy())


def keep(buffer: PathsBuffer, wanted: Int[np.ndarray, " paths"] | np.ndarray) -> PathsBuffer:
    """The valid paths among those wanted (a mask over the buffer)."""
    buffer.valid = buffer.valid & mi.Bool(wanted)
    buffer.discard_invalid()
    return buffer


@dataclass(frozen=True)
class Paths:
    """Exact paths with what each contributes.

    Attributes:
        targets: index of each path's target.
        sources: index of its source.
        responses: a e^{-j2πfτ}, complex128. a is Sionna's coefficient, which contains the free-space factor λ/4π: |y|²
            of a sum y of paths is the channel gain.
    """

    targets: Int[np.ndarray, " paths"]
    sources: Int[np.ndarray, " paths"]
    responses: Complex[np.ndarray, " paths"]

    def add_to(self, total: Complex[np.ndarray, "targets sources"]) -> None:
        """Add every path to its target's and source's response, one after another."""
        np.add.at(total, (self.targets, self.sources), self.responses)


def courses(buffer: PathsBuffer, sources: Antennas, targets: Antennas) -> list[Float[np.ndarray, "vertices 3"]]:
    """Where each path of the buffer runs: source, interactions, target; metres, world frame."""
    happened = buffer.interaction_types.numpy() != NONE
    vertices = np.stack([axis.numpy() for axis in (buffer.vertices_x, buffer.vertices_y, buffer.vertices_z)], axis=-1)
    starts = sources.positions[buffer.source_indices.numpy()]
    ends = targets.positions[buffer.target_indices.numpy()]
    return [
        np.concatenate([start[None], between[where], end[None]])
        for start, between, where, end in zip(starts, vertices, happened, ends, strict=True)
    ]


def fields(
    sionna: rt.Scene, buffer: PathsBuffer, sources: Antennas, targets: Antennas, propagation: Propagation
) -> Paths:
    """What each valid path of the buffer contributes, in the buffer's order."""
    if buffer.buffer_size == 0:
        nothing = np.zeros(0, np.int64)
        return Paths(nothing, nothing, np.zeros(0, np.complex128))
    buffer = FieldCalculator()(
        wavelength=sionna.wavelength,
        paths=buffer,
        samples_per_src=propagation.rays,
        diffraction=propagation.diffraction,
        src_positions=sources.points,
        tgt_positions=targets.points,
        src_orientations=sources.orientations,
        tgt_orientations=targets.orientations,
        src_antenna_patterns=[sources.pattern],
        tgt_antenna_patterns=[targets.pattern],
    )
    coefficient = buffer.a[0][0]
    amplitude = np.where(buffer.valid.numpy(), coefficient.real.numpy() + 1j * coefficient.imag.numpy(), 0)
    # In double precision: over a room the carrier turns some tens of times.
    turns = float(sionna.frequency[0]) * buffer.tau.numpy().astype(np.float64)
    return Paths(buffer.target_indices.numpy(), buffer.source_indices.numpy(), amplitude * np.exp(-2j * np.pi * turns))
