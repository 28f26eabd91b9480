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
from jaxtyping import Bool, Float, Int

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
    """The ways of paths that have as many reflections before the edge and after it.

    Attributes:
        vertices: reflections, point on the edge, reflections, in the order from source to target, metres.
        faces: number of the triangle of each reflection, counted through the scene's objects; meaningless at the edge.
        distances: s′ and s, from source and target to the point of diffraction, metres.
        sin_beta: sine of the angle β₀ between path and edge.
        detours: by how much the ways through the edge's start and end are longer than s′ + s, metres; negative where
            the point of diffraction lies beyond that end.
        excess: by how much s′ + s is longer than the way of the direct wave or of one that is reflected at a face,
            whichever is the longest; 0 at a shadow or reflection boundary, metres.
    """

    vertices: Float[np.ndarray, "paths interactions 3"]
    faces: Int[np.ndarray, "paths interactions"]
    distances: Float[np.ndarray, "paths 2"]
    sin_beta: Float[np.ndarray, " paths"]
    detours: Float[np.ndarray, "paths 2"]
    excess: Float[np.ndarray, " paths"]


def courses_of(
    planes: Planes, edges: Edges, chains: DiffractedChains, near: Ends, far: Ends, paths: Int[np.ndarray, "3 paths"]
) -> Courses:
    """The ways of paths of one shape.

    Args:
        planes: the scene's planes.
        edges: the scene's edges.
        chains: the chains.
        near: the sources' images by the near arms.
        far: the targets' images by the far arms.
        paths: of ``possible_paths``, all with as many reflections before the edge and after it.
    """
    count = int(chains.shapes[:1].sum()) + 1
    vertices = np.empty((paths.shape[1], count, 3))
    triangles = np.zeros((paths.shape[1], count), np.int64)
    distances, detours = np.empty((2, paths.shape[1], 2))
    with ONE_KERNEL:
        _place(*_arguments(planes, edges, chains, near, far), paths, vertices, triangles, distances, detours)  # type: ignore[call-arg]
    target, chain, source = paths
    a, b = chains.pairs[chain].T
    one, other = near.angle[source, a], far.angle[target, b]
    rho, exterior = near.away[source, a], edges.exterior[chains.near.edges[a]]
    # The smallest of the cosines belongs to the nearest boundary.
    cosine = np.cos([one - other, one + other, 2 * exterior - one - other]).min(axis=0)
    whole = distances.sum(axis=1)
    direct = np.sqrt(np.maximum(whole**2 - 2 * rho * far.away[target, b] * (1 + cosine), 0))
    sin_beta = rho / distances[:, 0]
    return Courses(vertices, planes.faces[triangles], distances, sin_beta, detours, whole - direct)


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
def _towards(normals, offsets, first, sides, planes, count, images, x, y, z, vertices, triangles, where, step):
    """Follow an arm from a point on its edge to the antenna; False where a reflection is on no surface.

    Fills ``vertices[where]``, ``vertices[where + step]`` …, unless ``step`` is 0.
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
            vertices[where] = x, y, z
            triangles[where] = triangle
            where += step
    return True


@numba.njit(cache=True, parallel=True)
def _try(normals, offsets, first, sides, planes, count, images, open_space, points, found):
    """Fill ``found`` [arms]."""
    nothing, none = np.empty((0, 3)), np.empty(0, np.int64)
    for arm in numba.prange(len(found)):
        for antenna in range(len(images)):
            for point in range(points.shape[1]):
                x, y, z = points[arm, point]
                if not found[arm] and open_space[antenna, arm]:
                    found[arm] = _towards(
                        normals, offsets, first, sides, planes[arm], count[arm], images[antenna, arm],
                        x, y, z, nothing, none, 0, 0,
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
    nothing, none = np.empty((0, 3)), np.empty(0, np.int64)
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
                    px, py, pz, nothing, none, 0, 0,
                ) and _towards(
                    normals, offsets, first, sides, near_planes[a], near_count[a], near_images[source, a],
                    px, py, pz, nothing, none, 0, 0,
                )  # fmt: skip


@numba.njit(cache=True, parallel=True)
def _place(
    normals, offsets, first, sides, starts, directions, lengths, edge, pairs,
    near_planes, near_count, near_images, near_along, near_away, near_open,
    far_planes, far_count, far_images, far_along, far_away, far_open,
    paths, vertices, triangles, distances, detours,
):  # fmt: skip
    """Fill ``vertices``, ``triangles``, ``distances`` and ``detours``."""
    for path in numba.prange(paths.shape[1]):
        target, chain, source = paths[0, path], paths[1, path], paths[2, path]
        a, b = pairs[chain]
        e = edge[chain]
        near_z, near_rho = near_along[source, a], near_away[source, a]
        far_z, far_rho = far_along[target, b], far_away[target, b]
        z, by_start, by_end = _diffraction_point(near_z, near_rho, far_z, far_rho, lengths[e])
        distances[path, 0] = np.hypot(near_rho, near_z - z)
        distances[path, 1] = np.hypot(far_rho, far_z - z)
        detours[path] = by_start, by_end
        z = min(max(z, 0.0), lengths[e])
        px = starts[e, 0] + z * directions[e, 0]
        py = starts[e, 1] + z * directions[e, 1]
        pz = starts[e, 2] + z * directions[e, 2]
        middle = near_count[a]
        vertices[path, middle] = px, py, pz
        _towards(
            normals, offsets, first, sides, near_planes[a], near_count[a], near_images[source, a],
            px, py, pz, vertices[path], triangles[path], middle - 1, -1,
        )  # fmt: skip
        _towards(
            normals, offsets, first, sides, far_planes[b], far_count[b], far_images[target, b],
            px, py, pz, vertices[path], triangles[path], middle + 1, 1,
        )  # fmt: skip
