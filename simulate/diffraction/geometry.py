"""Where a chain with one diffraction touches its surfaces and its edge.

The antenna at the end of an arm, mirrored at the arm's planes in turn, has the image I. Seen from the edge, the wave
comes straight from there. With the edge as the axis of cylindrical coordinates, source image (z₁, ρ₁) and target image
(z₂, ρ₂), the angles to the edge are equal (Keller's cone) at

    z = z₁ + (z₂ − z₁) ρ₁ / (ρ₁ + ρ₂).

A chain is a path if both antennas' waves are in the open space around the edge, and every reflection is on a surface.
Whether something blocks a path is tested later. A point beyond an end of the edge counts, too, as long as the way by
the end is not much longer (see ``simulate.diffraction.corners``); the path then passes through the end.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np
from jaxtyping import Bool, Complex, Float, Float32, Int, UInt32

from simulate.diffraction.arms import Arms
from simulate.diffraction.chains import DiffractedChains
from simulate.diffraction.corners import REACH
from simulate.diffraction.edges import Edges
from simulate.planes import Planes
from simulate.reflections import mirror, on_surface
from simulate.threads import ONE_KERNEL

MARGIN = 1e-6
"""Metres by which triangles are enlarged, so that no point is lost between two of them."""

TOO_NEAR = 1e-4
"""Metres and radians: an antenna that is nearer to an edge or to the plane of its face is not diffracted there."""


@dataclass(frozen=True)
class Ends:
    """The images of antennas by arms, seen from the arms' edges.

    Attributes:
        images: antenna mirrored at the first, the first two … planes of each arm, metres.
        along: z of the last image, metres from the edge's start.
        away: ρ of the last image, metres.
        angle: φ of the last image, from face 0 on, radians.
        open: whether the last image's direction is in the open space around the edge.
    """

    images: Float[np.ndarray, "antennas arms most 3"]
    along: Float[np.ndarray, "antennas arms"]
    away: Float[np.ndarray, "antennas arms"]
    angle: Float[np.ndarray, "antennas arms"]
    open: Bool[np.ndarray, "antennas arms"]


def ends_of(planes: Planes, edges: Edges, arms: Arms, antennas: Float[np.ndarray, "antennas 3"]) -> Ends:
    """Mirror antennas at the planes of arms.

    Args:
        planes: the scene's planes.
        edges: the scene's edges.
        arms: the arms.
        antennas: metres, world frame.
    """
    images = np.empty((len(arms), len(antennas), arms.planes.shape[1], 3))
    mirror(planes.normals, planes.offsets, arms.planes, arms.reflections, antennas, images)
    last = np.broadcast_to(antennas[:, None], (len(antennas), len(arms), 3)).copy()
    images = np.ascontiguousarray(images.swapaxes(0, 1))
    for count in range(1, arms.planes.shape[1] + 1):
        of = arms.reflections == count
        last[:, of] = images[:, of, count - 1]
    own = edges.subset(arms.edges)
    offset = last - own.starts
    along = (offset * own.directions).sum(axis=-1)
    x, y = (offset * own.tangents).sum(axis=-1), (offset * own.normals).sum(axis=-1)
    angle = np.arctan2(y, x) % (2 * np.pi)
    away = np.hypot(x, y)
    open_space = (angle > TOO_NEAR) & (angle < own.exterior - TOO_NEAR) & (away > TOO_NEAR)
    return Ends(images, along, away, angle, open_space)


POINTS = 16
"""Points of an edge at which an arm is tried."""


def reaches(planes: Planes, edges: Edges, arms: Arms, ends: Ends) -> Bool[np.ndarray, " arms"]:
    """Whether each arm's reflections are on surfaces for one of the antennas and one of some points of its edge.

    Args:
        planes: the scene's planes.
        edges: the scene's edges.
        arms: the arms.
        ends: the antennas' images by the arms.
    """
    points = edges.points((np.arange(POINTS) + 0.5) / POINTS)[arms.edges]
    found = np.zeros(len(arms), np.bool_)
    surfaces = planes.normals, planes.offsets, planes.first, planes.sides
    with ONE_KERNEL:
        _try(*surfaces, arms.planes, arms.reflections, ends.images, ends.open, points, found)
    return found


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
    possible = np.zeros((len(far.along), len(chains), len(near.along)), np.bool_)
    with ONE_KERNEL:
        _mark(*_arguments(planes, edges, chains, near, far), REACH * wavelength, possible)  # type: ignore[call-arg]
    return np.stack(np.nonzero(possible))


@dataclass(frozen=True)
class Courses:
    """The ways of paths that have as many reflections before the edge and after it, in single precision.

    Attributes:
        sources: index of each path's source.
        targets: index of its target.
        vertices: reflections, point on the edge, reflections, in the order from source to target, metres.
        faces: number of the triangle of each reflection, counted through the scene's objects; meaningless at the edge.
        edges: index of the edge.
        length: L (wedge.py), metres.
        sin_beta: sine of the angle β₀ between path and edge.
        detours: by how much the ways through the edge's start and end are longer than s′ + s, metres; negative where
            the point of diffraction lies beyond that end.
        excess: by how much s′ + s is longer than the way of the direct wave or of one that is reflected at a face,
            whichever is the longest; 0 at a shadow or reflection boundary, metres.
        propagation: λ/4π · e^{−jk(s′ + s)} / √(s′ s (s′ + s)), in double precision, since the path is many wavelengths
            long.
    """

    sources: UInt32[np.ndarray, " paths"]
    targets: UInt32[np.ndarray, " paths"]
    vertices: Float32[np.ndarray, "interactions 3 paths"]
    faces: UInt32[np.ndarray, "interactions paths"]
    edges: UInt32[np.ndarray, " paths"]
    length: Float32[np.ndarray, " paths"]
    sin_beta: Float32[np.ndarray, " paths"]
    detours: Float32[np.ndarray, "2 paths"]
    excess: Float32[np.ndarray, " paths"]
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
        paths: of ``possible_paths``, all with as many reflections before the edge and after it.
        first_target: index of target 0 of ``paths`` among all targets.
    """
    interactions, count = int(chains.shapes[:1].sum()) + 1, paths.shape[1]
    courses = Courses(
        sources=_aligned(np.uint32, count),
        targets=_aligned(np.uint32, count),
        vertices=_aligned(np.float32, interactions, 3, count),
        faces=_aligned(np.uint32, interactions, count),
        edges=_aligned(np.uint32, count),
        length=_aligned(np.float32, count),
        sin_beta=_aligned(np.float32, count),
        detours=_aligned(np.float32, 2, count),
        excess=_aligned(np.float32, count),
        propagation=np.empty(count, np.complex128),
    )
    courses.sources[:], courses.targets[:], courses.faces[:] = paths[2], paths[0] + first_target, 0
    known = near.angle, far.angle, edges.exterior, planes.faces, wavelength
    with ONE_KERNEL:
        _place(*_arguments(planes, edges, chains, near, far), *known, paths, *list(vars(courses).values())[2:])  # type: ignore[call-arg]
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


def _arguments(planes: Planes, edges: Edges, chains: DiffractedChains, near: Ends, far: Ends) -> tuple:
    arms = [
        array
        for arms, ends in ((chains.near, near), (chains.far, far))
        for array in (arms.planes, arms.reflections, ends.images, ends.along, ends.away, ends.open)
    ]
    edge = chains.near.edges[chains.pairs[:, 0]]
    surfaces = planes.normals, planes.offsets, planes.first, planes.sides
    return (*surfaces, edges.starts, edges.directions, edges.lengths, edge, chains.pairs, *arms)


@numba.njit(cache=True, inline="always")
def _towards(normals, offsets, first, sides, planes, count, images, x, y, z, vertices, hit, faces, where, step):
    """Follow an arm from a point on its edge to the antenna; False where a reflection is on no surface.

    Fills ``vertices[where]`` and ``hit[where]``, ``vertices[where + step]`` …, unless ``step`` is 0.
    """
    for k in range(count - 1, -1, -1):
        plane = planes[k]
        nx, ny, nz = normals[plane]
        ix, iy, iz = images[k]
        dx, dy, dz = ix - x, iy - y, iz - z
        rise = nx * dx + ny * dy + nz * dz
        distance = offsets[plane] - (nx * x + ny * y + nz * z)
        # The plane must lie between the point and the image; an edge is on no plane that it sees a reflection of.
        if distance * rise <= 0 or abs(distance) >= abs(rise) or abs(distance) < TOO_NEAR:
            return False
        share = distance / rise
        x, y, z = x + share * dx, y + share * dy, z + share * dz
        triangle = on_surface(first, sides, plane, x, y, z, MARGIN)
        if triangle < 0:
            return False
        if step != 0:
            vertices[where, 0], vertices[where, 1], vertices[where, 2] = x, y, z
            hit[where] = faces[triangle]
            where += step
    return True


@numba.njit(cache=True, parallel=True)
def _try(normals, offsets, first, sides, planes, count, images, open_space, points, found):
    """Fill ``found`` [arms]."""
    nothing, none, faces = np.empty((0, 3), np.float32), np.empty(0, np.uint32), np.empty(0, np.int64)
    for arm in numba.prange(len(found)):
        for antenna in range(len(images)):
            for point in range(points.shape[1]):
                x, y, z = points[arm, point]
                if not found[arm] and open_space[antenna, arm]:
                    found[arm] = _towards(
                        normals, offsets, first, sides, planes[arm], count[arm], images[antenna, arm],
                        x, y, z, nothing, none, faces, 0, 0,
                    )  # fmt: skip


@numba.njit(cache=True, inline="always")
def _diffraction_point(z1, rho1, z2, rho2, length):
    """z, and how much longer the ways through the edge's start and end are, negative if z lies beyond."""
    z = z1 + (z2 - z1) * rho1 / (rho1 + rho2)
    shortest = np.hypot(rho1 + rho2, z2 - z1)
    by_start = np.hypot(rho1, z1) + np.hypot(rho2, z2) - shortest
    by_end = np.hypot(rho1, z1 - length) + np.hypot(rho2, z2 - length) - shortest
    return z, by_start if z >= 0 else -by_start, by_end if z <= length else -by_end


@numba.njit(cache=True, parallel=True)
def _mark(
    normals, offsets, first, sides, starts, directions, lengths, edge, pairs,
    near_planes, near_count, near_images, near_along, near_away, near_open,
    far_planes, far_count, far_images, far_along, far_away, far_open, beyond, possible,
):  # fmt: skip
    """Fill ``possible`` [targets, chains, sources]."""
    nothing, none, faces = np.empty((0, 3), np.float32), np.empty(0, np.uint32), np.empty(0, np.int64)
    for target in numba.prange(len(far_along)):
        for chain in range(len(pairs)):
            a, b = pairs[chain]
            if not far_open[target, b]:
                continue
            e = edge[chain]
            for source in range(len(near_along)):
                if not near_open[source, a]:
                    continue
                z, by_start, by_end = _diffraction_point(
                    near_along[source, a], near_away[source, a], far_along[target, b], far_away[target, b], lengths[e]
                )
                if by_start < -beyond or by_end < -beyond:
                    continue
                z = min(max(z, 0.0), lengths[e])
                px = starts[e, 0] + z * directions[e, 0]
                py = starts[e, 1] + z * directions[e, 1]
                pz = starts[e, 2] + z * directions[e, 2]
                possible[target, chain, source] = _towards(
                    normals, offsets, first, sides, far_planes[b], far_count[b], far_images[target, b],
                    px, py, pz, nothing, none, faces, 0, 0,
                ) and _towards(
                    normals, offsets, first, sides, near_planes[a], near_count[a], near_images[source, a],
                    px, py, pz, nothing, none, faces, 0, 0,
                )  # fmt: skip


@numba.njit(cache=True, parallel=True)
def _place(
    normals, offsets, first, sides, starts, directions, lengths, edge, pairs,
    near_planes, near_count, near_images, near_along, near_away, near_open,
    far_planes, far_count, far_images, far_along, far_away, far_open,
    near_angle, far_angle, exterior, faces, wavelength, paths,
    vertices, faces_hit, edges, length, sin_beta, detours, excess, propagation,
):  # fmt: skip
    """Fill the fields of ``Courses``."""
    for path in numba.prange(paths.shape[1]):
        target, chain, source = paths[0, path], paths[1, path], paths[2, path]
        a, b = pairs[chain]
        e = edge[chain]
        edges[path] = e
        z1, rho1 = near_along[source, a], near_away[source, a]
        z2, rho2 = far_along[target, b], far_away[target, b]
        z, by_start, by_end = _diffraction_point(z1, rho1, z2, rho2, lengths[e])
        before, behind = np.hypot(rho1, z1 - z), np.hypot(rho2, z2 - z)
        whole = before + behind
        sin_beta[path] = rho1 / before
        length[path] = before * behind / whole * (rho1 / before) ** 2
        detours[0, path], detours[1, path] = by_start, by_end
        # The smallest of the cosines belongs to the nearest boundary.
        one, other = near_angle[source, a], far_angle[target, b]
        cosine = min(np.cos(one - other), np.cos(one + other), np.cos(2 * exterior[e] - one - other))
        excess[path] = whole - np.sqrt(max(whole**2 - 2 * rho1 * rho2 * (1 + cosine), 0.0))
        phase = -2 * np.pi * (whole / wavelength % 1)
        amplitude = wavelength / (4 * np.pi) / np.sqrt(before * behind * whole)
        propagation[path] = amplitude * complex(np.cos(phase), np.sin(phase))
        z = min(max(z, 0.0), lengths[e])
        px = starts[e, 0] + z * directions[e, 0]
        py = starts[e, 1] + z * directions[e, 1]
        pz = starts[e, 2] + z * directions[e, 2]
        middle = near_count[a]
        vertices[middle, 0, path], vertices[middle, 1, path], vertices[middle, 2, path] = px, py, pz
        _towards(
            normals, offsets, first, sides, near_planes[a], near_count[a], near_images[source, a],
            px, py, pz, vertices[:, :, path], faces_hit[:, path], faces, middle - 1, -1,
        )  # fmt: skip
        _towards(
            normals, offsets, first, sides, far_planes[b], far_count[b], far_images[target, b],
            px, py, pz, vertices[:, :, path], faces_hit[:, path], faces, middle + 1, 1,
        )  # fmt: skip
