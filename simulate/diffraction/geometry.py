"""Where a chain with one or two diffractions touches its surfaces and its edges.

The antenna at the end of an arm, mirrored at the arm's planes in turn, has the image I. Seen from the edge, the wave
comes straight from there. With the edge as the axis of cylindrical coordinates, source image (z₁, ρ₁) and target image
(z₂, ρ₂), the angles to the edge are equal (Keller's cone) at

    z = z₁ + (z₂ − z₁) ρ₁ / (ρ₁ + ρ₂).

Two points of diffraction are where the whole way is shortest, which Newton's method finds.

A chain is a path if both antennas' waves are in the open space around their edges, and every reflection is on a
surface. Whether something blocks a path is tested later. A point beyond an end of the edge counts, too, as long as the
way by the end is not much longer (see ``simulate.diffraction.corners``); the path then passes through the end.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numba
import numpy as np
from jaxtyping import Complex, Float32, Int, UInt32

from simulate.diffraction.chains import NO_LINK, DiffractedChains
from simulate.diffraction.edges import Edges
from simulate.diffraction.ends import Ends, follow, legs_of, surfaces_of
from simulate.diffraction.links import THROUGH_SPACE, lift_of
from simulate.diffraction.points import (
    angle_about,
    around_edge,
    distance,
    length_between,
    on_edge,
    on_edge_or_end,
    points_of_diffraction,
    shortest,
    sine_between,
    wedge_of,
)
from simulate.planes import Planes
from simulate.threads import ONE_KERNEL

APART = 1 / 4
"""Wavelengths. Two points of diffraction that are nearer belong to a corner, which two edges do not describe; from
there to twice as far the wave's weight rises from 0 to 1."""

BLOCK = 1024
"""Paths that one thread places at a time."""


def possible_paths(
    planes: Planes, edges: Edges, chains: DiffractedChains, near: Ends, far: Ends, wavelength: float
) -> Int[np.ndarray, "3 paths"]:
    """Combinations (target, chain, source) whose vertices are all where they should be, in lexical order.

    Args:
        planes: the scene's planes.
        edges: the scene's edges.
        chains: the chains.
        near: the sources' images by the near arms.
        far: the targets' images by the far arms.
        wavelength: metres.
    """
    possible = np.zeros((len(far.last), len(chains), len(near.last)), np.bool_)
    with ONE_KERNEL:
        _mark(*_arguments(planes, edges, chains, near, far, wavelength), possible)  # type: ignore[call-arg]
    return np.stack(np.nonzero(possible))


@dataclass(frozen=True)
class Courses:
    """The ways of paths that have as many reflections and diffractions, in single precision.

    Attributes:
        sources: index of each path's source.
        targets: index of its target.
        vertices: reflections, points on edges, reflections, in the order from source to target, metres.
        faces: number of the triangle of each reflection, counted through the scene's objects; meaningless at an edge.
        edges: index of each edge.
        angles: φ′ and φ at it, radians.
        length: L at it (wedge.py), metres.
        sin_beta: sine of the angle β₀ between path and edge.
        detours: by how much the ways through the edge's start and end are longer, from the vertex before the edge to
            the one after it; negative where the point of diffraction lies beyond that end, metres.
        excess: by how much the way by the edge is longer than that of a wave that goes straight or is reflected at a
            face of the edge, whichever is the longest; 0 at a shadow or reflection boundary, metres.
        propagation: λ/4π, the spreading, and e^{−jk(length of the path)}, in double precision, since the path is many
            wavelengths long.
    """

    sources: UInt32[np.ndarray, " paths"]
    targets: UInt32[np.ndarray, " paths"]
    vertices: Float32[np.ndarray, "interactions 3 paths"]
    faces: UInt32[np.ndarray, "interactions paths"]
    edges: UInt32[np.ndarray, "diffractions paths"]
    angles: Float32[np.ndarray, "diffractions 2 paths"]
    length: Float32[np.ndarray, "diffractions paths"]
    sin_beta: Float32[np.ndarray, "diffractions paths"]
    detours: Float32[np.ndarray, "diffractions 2 paths"]
    excess: Float32[np.ndarray, "diffractions paths"]
    propagation: Complex[np.ndarray, " paths"]


def courses_of(
    planes: Planes,
    edges: Edges,
    chains: DiffractedChains,
    near: Ends,
    far: Ends,
    wavelength: float,
    paths: Int[np.ndarray, "3 paths"],
    first_target: int,
) -> Courses:
    """The ways of paths of one shape.

    Args:
        planes: the scene's planes.
        edges: the scene's edges.
        chains: the chains.
        near: the sources' images by the near arms.
        far: the targets' images by the far arms.
        wavelength: metres.
        paths: of ``possible_paths``, all of one shape.
        first_target: index of target 0 of ``paths`` among all targets.
    """
    interactions, count = int(chains.shapes[:1].sum()), paths.shape[1]
    diffractions = int(chains.shapes[:1, 1].sum())
    courses = Courses(
        sources=_aligned(np.uint32, count),
        targets=_aligned(np.uint32, count),
        vertices=_aligned(np.float32, interactions, 3, count),
        faces=_aligned(np.uint32, interactions, count),
        edges=_aligned(np.uint32, diffractions, count),
        angles=_aligned(np.float32, diffractions, 2, count),
        length=_aligned(np.float32, diffractions, count),
        sin_beta=_aligned(np.float32, diffractions, count),
        detours=_aligned(np.float32, diffractions, 2, count),
        excess=_aligned(np.float32, diffractions, count),
        propagation=np.empty(count, np.complex128),
    )
    courses.sources[:], courses.targets[:], courses.faces[:] = paths[2], paths[0] + first_target, 0
    with ONE_KERNEL:
        filled = _Filled(*list(vars(courses).values())[2:])
        _place(*_arguments(planes, edges, chains, near, far, wavelength), paths, filled)  # type: ignore[call-arg]
    return courses


ALIGNMENT = 64
"""Bytes. Dr.Jit uses numpy's memory as it is, and compiles a kernel anew for arrays that begin elsewhere."""


def _aligned(kind: type, *shape: int) -> np.ndarray:
    """An array of four-byte numbers, each row of which begins at a multiple of ``ALIGNMENT``."""
    columns = -(-shape[-1] * 4 // ALIGNMENT) * ALIGNMENT
    size = int(np.prod(shape[:-1])) * columns
    memory = np.empty(size + ALIGNMENT, np.uint8)
    start = -memory.ctypes.data % ALIGNMENT
    return memory[start : start + size].view(kind).reshape(*shape[:-1], columns // 4)[..., : shape[-1]]


class _Filled(NamedTuple):
    """Fields of ``Courses`` that ``_place`` fills."""

    vertices: np.ndarray
    faces: np.ndarray
    edges: np.ndarray
    angles: np.ndarray
    length: np.ndarray
    sin_beta: np.ndarray
    detours: np.ndarray
    excess: np.ndarray
    propagation: np.ndarray


class _Wedges(NamedTuple):
    """Arrays of ``Edges``."""

    starts: np.ndarray
    directions: np.ndarray
    lengths: np.ndarray
    exterior: np.ndarray
    normals: np.ndarray
    tangents: np.ndarray


class _Route(NamedTuple):
    """Arrays of ``DiffractedChains``: arms, edges, and the face that the way between the edges runs along."""

    pairs: np.ndarray
    edges: np.ndarray
    twice: np.ndarray
    faces: np.ndarray
    lifts: np.ndarray


def _arguments(
    planes: Planes, edges: Edges, chains: DiffractedChains, near: Ends, far: Ends, wavelength: float
) -> tuple:
    twice = chains.link != NO_LINK
    faces = np.full((len(chains), 2), THROUGH_SPACE)
    faces[twice] = chains.links.faces[chains.link[twice]]
    lifts = np.stack([lift_of(edges.subset(chains.edges[:, end]), faces[:, end]) for end in (0, 1)], axis=1)
    route = _Route(chains.pairs, chains.edges, twice, faces, lifts)
    wedges = _Wedges(**vars(edges))
    return surfaces_of(planes), wedges, route, legs_of(chains.near, near), legs_of(chains.far, far), wavelength


@numba.njit(cache=True, parallel=True)
def _mark(surfaces, wedges, route, near, far, wavelength, possible):
    """Fill ``possible`` [targets, chains, sources]."""
    for target in numba.prange(len(far.last)):
        _mark_target(surfaces, wedges, route, near, far, wavelength, target, possible[target])


@numba.njit(cache=True)
def _mark_target(surfaces, wedges, route, near, far, wavelength, target, possible):
    """Fill ``possible`` [chains, sources] of one target."""
    nothing, none = np.empty((0, 3), np.float32), np.empty(0, np.uint32)
    for chain in range(len(route.pairs)):
        a, b = route.pairs[chain, 0], route.pairs[chain, 1]
        if not far.open[target, b]:
            continue
        first, second = wedge_of(wedges, route.edges[chain, 0]), wedge_of(wedges, route.edges[chain, 1])
        twice, face = route.twice[chain], route.faces[chain, 0]
        end = (far.last[target, b, 0], far.last[target, b, 1], far.last[target, b, 2])
        for source in range(len(near.last)):
            if not near.open[source, a]:
                continue
            begin = (near.last[source, a, 0], near.last[source, a, 1], near.last[source, a, 2])
            s, t = points_of_diffraction(first, second, twice, face, begin, end, wavelength)
            if np.isnan(s):
                continue
            p, q = on_edge_or_end(first, s), on_edge_or_end(second, t)
            possible[chain, source] = follow(
                surfaces, far, target, b, q[0], q[1], q[2], nothing, none, 0, 0
            ) and follow(surfaces, near, source, a, p[0], p[1], p[2], nothing, none, 0, 0)


@numba.njit(cache=True, parallel=True)
def _place(surfaces, wedges, route, near, far, wavelength, paths, filled):
    """Fill the fields of ``Courses``."""
    for block in numba.prange(-(-paths.shape[1] // BLOCK)):
        _place_block(surfaces, wedges, route, near, far, wavelength, paths, block * BLOCK, filled)


@numba.njit(cache=True)
def _place_block(surfaces, wedges, route, near, far, wavelength, paths, start, filled):
    """Fill the fields of ``Courses`` for ``BLOCK`` paths."""
    for path in range(start, min(start + BLOCK, paths.shape[1])):
        target, chain, source = paths[0, path], paths[1, path], paths[2, path]
        a, b = route.pairs[chain, 0], route.pairs[chain, 1]
        first, second = wedge_of(wedges, route.edges[chain, 0]), wedge_of(wedges, route.edges[chain, 1])
        twice, face = route.twice[chain], route.faces[chain, 0]
        begin = (near.last[source, a, 0], near.last[source, a, 1], near.last[source, a, 2])
        end = (far.last[target, b, 0], far.last[target, b, 1], far.last[target, b, 2])
        phi_begin, phi_end = near.angle[source, a], far.angle[target, b]
        s, t = shortest(first, second, twice, face, begin, end)
        p, q = on_edge(first, s), on_edge(second, t)
        phi_behind, phi_before = phi_end, phi_begin
        if twice:
            phi_behind, phi_before = angle_about(first, q), angle_about(second, p)
            if face != THROUGH_SPACE:
                phi_behind, phi_before = face * first[5], route.faces[chain, 1] * second[5]
        before, apart, sine, by_start, by_end, excess = around_edge(
            first, begin, q if twice else end, phi_begin, phi_behind
        )
        filled.edges[0, path], filled.sin_beta[0, path], filled.excess[0, path] = route.edges[chain, 0], sine, excess
        filled.angles[0, 0, path], filled.angles[0, 1, path] = phi_begin, phi_behind
        filled.detours[0, 0, path], filled.detours[0, 1, path] = by_start, by_end
        if twice:
            _, behind, other_sine, by_start, by_end, excess = around_edge(second, p, end, phi_before, phi_end)
            filled.edges[1, path], filled.sin_beta[1, path] = route.edges[chain, 1], other_sine
            filled.excess[1, path] = excess
            filled.angles[1, 0, path], filled.angles[1, 1, path] = phi_before, phi_end
            filled.detours[1, 0, path], filled.detours[1, 1, path] = by_start, by_end
            whole = before + apart + behind
            weight = min(max(apart / (APART * wavelength) - 1, 0.0), 1.0)
            if face != THROUGH_SPACE:
                weight /= 2  # the field on a face is the incident and the reflected one, which are one wave here
            # Behind the first edge the wavefront has the radii s₁₂ across it and s′ + s₁₂ along it.
            twist = sine_between(first, second, p, q)
            spreading = weight / np.sqrt(before * behind * (apart * whole + before * behind * twist**2))
            # Near a boundary of the second edge (share 1) the first is as for a wave that goes on to the target, and
            # the second has its wavefront; near one of the first edge it is the other way round.
            share = filled.excess[0, path] / (filled.excess[0, path] + excess + 1e-12)
            # At a shadow boundary the other edge's wave has the ends that it has alone.
            wavenumber = 2 * np.pi / wavelength
            here = share * np.exp(-wavenumber * (apart + behind - distance(p, end)))
            there = (1 - share) * np.exp(-wavenumber * (before + apart - distance(begin, q)))
            _, _, _, start_alone, end_alone, alone = around_edge(first, begin, end, phi_begin, phi_behind)
            filled.detours[0, 0, path] += here * (start_alone - filled.detours[0, 0, path])
            filled.detours[0, 1, path] += here * (end_alone - filled.detours[0, 1, path])
            filled.excess[0, path] += here * (alone - filled.excess[0, path])
            _, _, _, start_alone, end_alone, alone = around_edge(second, begin, end, phi_before, phi_end)
            filled.detours[1, 0, path] += there * (start_alone - by_start)
            filled.detours[1, 1, path] += there * (end_alone - by_end)
            filled.excess[1, path] += there * (alone - excess)
            one = share * before * (apart + behind) / whole + (1 - share) * length_between(behind, apart, before, twist)
            other = (
                share * length_between(before, apart, behind, twist) + (1 - share) * (before + apart) * behind / whole
            )
            filled.length[0, path], filled.length[1, path] = one * sine**2, other * other_sine**2
        else:
            whole = before + apart
            spreading = 1 / np.sqrt(before * apart * whole)
            filled.length[0, path] = before * apart / whole * sine**2
        phase, amplitude = -2 * np.pi * (whole / wavelength % 1), wavelength / (4 * np.pi) * spreading
        filled.propagation[path] = amplitude * complex(np.cos(phase), np.sin(phase))
        p, q = on_edge_or_end(first, s), on_edge_or_end(second, t)
        middle, last = near.reflections[a], near.reflections[a] + (1 if twice else 0)
        for axis in range(3):
            filled.vertices[middle, axis, path] = p[axis] + route.lifts[chain, 0, axis]
            filled.vertices[last, axis, path] = q[axis] + route.lifts[chain, 1, axis]
        vertices, faces = filled.vertices[:, :, path], filled.faces[:, path]
        follow(surfaces, near, source, a, p[0], p[1], p[2], vertices, faces, middle - 1, -1)
        follow(surfaces, far, target, b, q[0], q[1], q[2], vertices, faces, last + 1, 1)
