"""The points where a chain with one or two diffractions touches its surfaces and its edges.

The antenna at the end of an arm, mirrored at the arm's planes in turn, has the image I. Seen from the edge, the wave
comes straight from I. Take the edge as the axis of cylindrical coordinates, with the source image at (z₁, ρ₁) and the
target image at (z₂, ρ₂). Then the angles to the edge are equal (Keller's cone) at

    z = z₁ + (z₂ − z₁) ρ₁ / (ρ₁ + ρ₂).

With two diffractions, Newton's method finds the two points for which the whole way is shortest.

A chain is a path if the waves of both antennas are in the open space around their edges, and every reflection is on a
surface. Whether something blocks the path is tested later. A point of diffraction may lie beyond an end of the edge if
the way through the end is not much longer (``end_weight``). The path then passes through the
end.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numba
import numpy as np
from jaxtyping import Float32, Int, UInt32

from simulate.parallel.compiled import ONE_KERNEL, compiled
from simulate.rays.core.electric_field import Ways, aligned
from simulate.rays.core.planes import Planes
from simulate.rays.diffraction.arms import Ends, follow, legs_of
from simulate.rays.diffraction.diffraction_chains import NO_LINK, THROUGH_SPACE, DiffractedChains, lift_of
from simulate.rays.diffraction.diffraction_points import on_edge_or_end, points_of_diffraction, shortest, wedge_of
from simulate.rays.diffraction.distance_parameters import around_one, around_two
from simulate.rays.diffraction.edges import Edges

BLOCK = 1024  # Number of paths that one thread handles at a time


@dataclass(frozen=True)
class PathGeometry(Ways):
    """The ways of paths with equal numbers of reflections and diffractions, in single precision."""

    edges: UInt32[np.ndarray, "diffractions paths"]  # index of each edge
    angles: Float32[np.ndarray, "diffractions 2 paths"]  # φ′ and φ at each edge, radians
    length: Float32[np.ndarray, "diffractions paths"]  # L at each edge (``transition_pairs``), metres
    sin_beta: Float32[np.ndarray, "diffractions paths"]  # sine of the angle β₀ between path and edge
    # how much longer the ways through the start and the end of the edge are, from the vertex before the edge to the
    # vertex after it, metres; negative if the point of diffraction lies beyond that end
    detours: Float32[np.ndarray, "diffractions 2 paths"]
    # how much longer the way by the edge is than the way of a wave that goes straight or is reflected at a face of
    # the edge, whichever is longest, metres; 0 at a shadow or reflection boundary
    excess: Float32[np.ndarray, "diffractions paths"]


@dataclass(frozen=True)
class Combinations:
    """Every combination of a target, a chain and a source."""

    planes: Planes  # the scene's planes
    edges: Edges  # the scene's edges
    chains: DiffractedChains  # the chains, all of the same shape
    near: Ends  # the images of the sources by the near arms
    far: Ends  # the images of the targets by the far arms
    wavelength: float  # metres

    def possible(self) -> Int[np.ndarray, "3 paths"]:
        """The combinations (target, chain, source) whose vertices are all in valid places, in lexical order."""
        possible = np.zeros((len(self.far.last), len(self.chains), len(self.near.last)), np.bool_)
        with ONE_KERNEL:
            _mark(*self._arrays, possible)  # type: ignore[call-arg]
        return np.stack(np.nonzero(possible))

    def geometry(self, paths: Int[np.ndarray, "3 paths"], first_target: int) -> PathGeometry:
        """The ways of some of the possible combinations."""
        before, diffractions, after = (int(number) for number in self.chains.shapes[0])
        interactions, count = before + diffractions + after, paths.shape[1]
        geometry = PathGeometry(
            sources=aligned(np.uint32, count),
            targets=aligned(np.uint32, count),
            vertices=aligned(np.float32, interactions, 3, count),
            faces=aligned(np.uint32, interactions, count),
            edges=aligned(np.uint32, diffractions, count),
            angles=aligned(np.float32, diffractions, 2, count),
            length=aligned(np.float32, diffractions, count),
            sin_beta=aligned(np.float32, diffractions, count),
            detours=aligned(np.float32, diffractions, 2, count),
            excess=aligned(np.float32, diffractions, count),
            travelled=np.empty(count),
            spreading=np.empty(count),
        )
        geometry.sources[:], geometry.targets[:], geometry.faces[:] = paths[2], paths[0] + first_target, 0
        filled = _Filled(**{name: getattr(geometry, name) for name in _Filled._fields})
        with ONE_KERNEL:
            _place(*self._arrays, paths, filled)  # type: ignore[call-arg]
        return geometry

    @cached_property
    def _arrays(self) -> tuple:
        """The arguments of the kernels."""
        chains = self.chains
        twice = chains.link != NO_LINK
        faces = np.full((len(chains), 2), THROUGH_SPACE)
        faces[twice] = chains.links.faces[chains.link[twice]]
        edges = chains.edges
        lifts = np.stack([lift_of(self.edges.subset(edges[:, end]), faces[:, end]) for end in (0, 1)], axis=1)
        route = _Route(chains.pairs, edges, twice, faces, lifts)
        near, far = legs_of(chains.near, self.near), legs_of(chains.far, self.far)
        wedges = _Wedges(*(getattr(self.edges, name) for name in _Wedges._fields))
        return self.planes.arrays, wedges, route, near, far, self.wavelength


class _Filled(NamedTuple):
    """Fields of ``PathGeometry`` that ``_place`` fills."""

    vertices: np.ndarray
    faces: np.ndarray
    edges: np.ndarray
    angles: np.ndarray
    length: np.ndarray
    sin_beta: np.ndarray
    detours: np.ndarray
    excess: np.ndarray
    travelled: np.ndarray
    spreading: np.ndarray


class _Wedges(NamedTuple):
    """Arrays of ``Edges``."""

    starts: np.ndarray
    directions: np.ndarray
    lengths: np.ndarray
    exterior: np.ndarray
    normals: np.ndarray
    tangents: np.ndarray


class _Route(NamedTuple):
    """Arrays of ``DiffractedChains``: arms, edges, and the face along which the way between the edges runs."""

    pairs: np.ndarray
    edges: np.ndarray
    twice: np.ndarray
    faces: np.ndarray
    lifts: np.ndarray


@compiled(parallel=True)
def _mark(surfaces, wedges, route, near, far, wavelength, possible):
    """Fill ``possible`` [targets, chains, sources]."""
    for target in numba.prange(len(far.last)):
        _mark_target(surfaces, wedges, route, near, far, wavelength, target, possible[target])


@compiled
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


@compiled(parallel=True)
def _place(surfaces, wedges, route, near, far, wavelength, paths, filled):
    """Fill the fields of ``PathGeometry``."""
    for block in numba.prange(-(-paths.shape[1] // BLOCK)):
        _place_block(surfaces, wedges, route, near, far, wavelength, paths, block * BLOCK, filled)


@compiled
def _place_block(surfaces, wedges, route, near, far, wavelength, paths, start, filled):
    """Fill the fields of ``PathGeometry`` for ``BLOCK`` paths."""
    for path in range(start, min(start + BLOCK, paths.shape[1])):
        target, chain, source = paths[0, path], paths[1, path], paths[2, path]
        a, b = route.pairs[chain, 0], route.pairs[chain, 1]
        first, second = wedge_of(wedges, route.edges[chain, 0]), wedge_of(wedges, route.edges[chain, 1])
        twice, face = route.twice[chain], route.faces[chain, 0]
        begin = (near.last[source, a, 0], near.last[source, a, 1], near.last[source, a, 2])
        end = (far.last[target, b, 0], far.last[target, b, 1], far.last[target, b, 2])
        phi_begin, phi_end = near.angle[source, a], far.angle[target, b]
        s, t = shortest(first, second, twice, face, begin, end)
        if twice:
            faces = face, route.faces[chain, 1]
            whole, spreading, figures = around_two(
                first, second, faces, s, t, begin, end, phi_begin, phi_end, wavelength
            )
        else:
            whole, spreading, figures = around_one(first, begin, end, phi_begin, phi_end)
        for number in range(2 if twice else 1):
            phi_before, phi_behind, sine, by_start, by_end, excess, length = figures[number]
            filled.edges[number, path] = route.edges[chain, number]
            filled.angles[number, 0, path], filled.angles[number, 1, path] = phi_before, phi_behind
            filled.sin_beta[number, path] = sine
            filled.detours[number, 0, path], filled.detours[number, 1, path] = by_start, by_end
            filled.excess[number, path], filled.length[number, path] = excess, length
        filled.travelled[path], filled.spreading[path] = whole, spreading
        p, q = on_edge_or_end(first, s), on_edge_or_end(second, t)
        middle, last = near.reflections[a], near.reflections[a] + (1 if twice else 0)
        for axis in range(3):
            filled.vertices[middle, axis, path] = p[axis] + route.lifts[chain, 0, axis]
            filled.vertices[last, axis, path] = q[axis] + route.lifts[chain, 1, axis]
        vertices, faces = filled.vertices[:, :, path], filled.faces[:, path]
        follow(surfaces, near, source, a, p[0], p[1], p[2], vertices, faces, middle - 1, -1)
        follow(surfaces, far, target, b, q[0], q[1], q[2], vertices, faces, last + 1, 1)
