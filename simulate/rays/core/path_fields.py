"""The response that a path contributes, from the electric field along the path.

At every reflection, and where the path passes through an object, the field is multiplied by the coefficients of a slab
[itu2023]. A path that a conductor blocks contributes nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Complex, Float, Float32, UInt32

from simulate.rays.core.electric_field import Field, pass_through, pattern, slab
from simulate.rays.core.propagation import MOST_PASSES
from simulate.rays.core.ray_tracer import dr, mi
from simulate.rays.core.sionna_scene import Antennas
from simulate.rays.core.surfaces import Surfaces


@dataclass(frozen=True)
class Ways:
    """The ways of paths with equal numbers of interactions, in single precision.

    Attributes:
        sources: index of each path's source.
        targets: index of each path's target.
        vertices: places of the interactions, in the order from source to target, metres.
        faces: number of the triangle of each reflection, counted through the scene's objects; meaningless at an edge.
        travelled: length of each path, metres; in double precision, since a path is many wavelengths long.
        spreading: what is left of the amplitude of a wave behind its antenna and edges, per metre: 1 / length for a
            path without edges.
    """

    sources: UInt32[np.ndarray, " paths"]
    targets: UInt32[np.ndarray, " paths"]
    vertices: Float32[np.ndarray, "interactions 3 paths"]
    faces: UInt32[np.ndarray, "interactions paths"]
    travelled: Float[np.ndarray, " paths"]
    spreading: Float[np.ndarray, " paths"]

    def propagation(self, wavelength: float) -> Complex[np.ndarray, " paths"]:
        """λ/4π times the spreading times e^{−jk(length of the path)}."""
        return wavelength / (4 * np.pi) * self.spreading * np.exp(-2j * np.pi * (self.travelled / wavelength % 1))


ALIGNMENT = 64
"""Bytes. Dr.Jit uses NumPy's memory directly, and compiles a kernel again for arrays with another alignment."""


def aligned(kind: type, *shape: int) -> np.ndarray:
    """An array of four-byte numbers whose rows all begin at a multiple of ``ALIGNMENT``."""
    columns = -(-shape[-1] * 4 // ALIGNMENT) * ALIGNMENT
    size = int(np.prod(shape[:-1])) * columns
    memory = np.empty(size + ALIGNMENT, np.uint8)
    start = -memory.ctypes.data % ALIGNMENT
    return memory[start : start + size].view(kind).reshape(*shape[:-1], columns // 4)[..., : shape[-1]]


AtEdge = Callable[[Field, mi.Vector3f, mi.Vector3f], Field]
"""The field behind an edge, from the field before it and the directions before and behind it."""


def path_responses(
    surfaces: Surfaces,
    sources: Antennas,
    targets: Antennas,
    ways: Ways,
    at_edges: Mapping[int, AtEdge] = {},
) -> Complex[np.ndarray, " paths"]:
    """The contribution of each path to the response between its source and its target, 0 if it is blocked.

    Args:
        surfaces: surfaces of the scene, at the frequency of the wave.
        sources: the antennas where the paths begin.
        targets: the antennas where the paths end.
        ways: the ways of the paths.
        at_edges: what an edge does to the field, for the numbers of the interactions that are diffractions. All others
            are reflections.

    Returns:
        a e^{−j2πfτ}, complex128. The amplitude a contains the free-space factor λ/4π.
    """
    interactions = len(ways.vertices)
    passes = mi.UInt(MOST_PASSES if surfaces.refraction else 0)
    points = [dr.gather(mi.Point3f, sources.points, mi.UInt(ways.sources))]
    points += [mi.Point3f(*(mi.Float(axis) for axis in vertex)) for vertex in ways.vertices]
    points += [dr.gather(mi.Point3f, targets.points, mi.UInt(ways.targets))]
    steps = [mi.Vector3f(after - before) for before, after in pairwise(points)]
    lengths = [mi.Float(dr.norm(step)) for step in steps]
    directions = [mi.Vector3f(step / length) for step, length in zip(steps, lengths, strict=True)]

    field, blocked = pattern(sources, directions[0]), mi.Bool(False)
    for number, way in enumerate(directions):
        field, passes, blocked = pass_through(surfaces, points[number], way, lengths[number], field, passes, blocked)
        if number in at_edges:
            field = at_edges[number](field, way, directions[number + 1])
        elif number < interactions:
            face = mi.UInt(ways.faces[number])
            te, tm, _, _ = surfaces.coefficients(face, way)
            smooth = dr.sqrt(1 - surfaces.scattering(face) ** 2)  # the rest is scattered
            field = slab(field, way, directions[number + 1], surfaces.normal(face), smooth * te, smooth * tm)
    received = pattern(targets, -directions[-1])
    real = dr.dot(received[0], field[0]) + dr.dot(received[1], field[1])
    imaginary = dr.dot(received[0], field[1]) - dr.dot(received[1], field[0])
    amplitude = dr.select(blocked, mi.Complex2f(0), mi.Complex2f(real, imaginary))
    dr.eval(amplitude)
    return (amplitude.real.numpy() + 1j * amplitude.imag.numpy()) * ways.propagation(surfaces.wavelength)
