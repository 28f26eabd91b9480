"""Arms: the ways from an antenna to an edge, straight or with reflections, and the images of antennas by them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numba
import numpy as np
from jaxtyping import Bool, Float, Int

from simulate.parallel.compiled import ONE_KERNEL, compiled
from simulate.rays.core.image_method import mirror, reflection
from simulate.rays.core.planes import Planes
from simulate.rays.diffraction.edges import Edges


@dataclass(frozen=True)
class Arms:
    """Sequences of reflections between an antenna and an edge."""

    planes: Int[np.ndarray, "arms most"]  # planes of the reflections, from the antenna on; −1 after the last one
    edges: Int[np.ndarray, " arms"]  # index of each arm's edge

    def __len__(self) -> int:
        return len(self.edges)

    def subset(self, index: Int[np.ndarray, " k"] | Bool[np.ndarray, " arms"]) -> Arms:
        """The arms with these indices, or those that a mask selects."""
        return Arms(self.planes[index], self.edges[index])

    @property
    def reflections(self) -> Int[np.ndarray, " arms"]:
        """Number of reflections of each arm."""
        return (self.planes >= 0).sum(axis=1)


TOO_NEAR = 1e-4
"""Metres and radians. The wave of an antenna that is nearer to an edge, or to the plane of its face, is not diffracted
there."""

POINTS = 16  # Number of points of an edge at which an arm is tried


@dataclass(frozen=True)
class Ends:
    """The images of antennas by arms, seen from the arms' edges."""

    # antenna mirrored at the first plane, the first two planes and so on of each arm, metres
    images: Float[np.ndarray, "antennas arms most 3"]
    last: Float[np.ndarray, "antennas arms 3"]  # image by all planes, metres
    angle: Float[np.ndarray, "antennas arms"]  # φ of the last image about the edge, from face 0 on, radians
    # whether the direction of the last image is in the open space around the edge
    open: Bool[np.ndarray, "antennas arms"]


def ends_of(planes: Planes, edges: Edges, arms: Arms, antennas: Float[np.ndarray, "antennas 3"]) -> Ends:
    """Mirror antennas at the planes of arms."""
    images = np.empty((len(arms), len(antennas), arms.planes.shape[1], 3))
    mirror(planes.normals, planes.offsets, arms.planes, arms.reflections, antennas, images)
    last = np.broadcast_to(antennas[:, None], (len(antennas), len(arms), 3)).copy()
    images = np.ascontiguousarray(images.swapaxes(0, 1))
    for count in range(1, arms.planes.shape[1] + 1):
        of = arms.reflections == count
        last[:, of] = images[:, of, count - 1]
    own = edges.subset(arms.edges)
    offset = last - own.starts
    x, y = (offset * own.tangents).sum(axis=-1), (offset * own.normals).sum(axis=-1)
    angle = np.arctan2(y, x) % (2 * np.pi)
    open_space = (angle > TOO_NEAR) & (angle < own.exterior - TOO_NEAR) & (np.hypot(x, y) > TOO_NEAR)
    return Ends(images, last, angle, open_space)


def reaches(planes: Planes, edges: Edges, arms: Arms, ends: Ends) -> Bool[np.ndarray, " arms"]:
    """Whether the reflections of each arm are on surfaces, for one of the antennas and some point of the arm's edge."""
    points = edges.points((np.arange(POINTS) + 0.5) / POINTS)[arms.edges]
    found = np.zeros(len(arms), np.bool_)
    with ONE_KERNEL:
        _try(planes.arrays, legs_of(arms, ends), points, found)
    return found


class Legs(NamedTuple):
    """Arrays of ``Arms`` and ``Ends`` that the kernels need."""

    planes: np.ndarray
    reflections: np.ndarray
    images: np.ndarray
    last: np.ndarray
    angle: np.ndarray
    open: np.ndarray


def legs_of(arms: Arms, ends: Ends) -> Legs:
    """Arms, and the images by them, for the kernels."""
    return Legs(arms.planes, arms.reflections, ends.images, ends.last, ends.angle, ends.open)


@compiled(inline="always")
def follow(surfaces, legs, antenna, arm, x, y, z, vertices, hit, where, step):
    """Follow an arm from a point on its edge to the antenna; False if a reflection is on no surface.

    Unless ``step`` is 0, this fills ``vertices`` and ``hit`` at ``where``, ``where + step`` and so on.
    """
    for k in range(legs.reflections[arm] - 1, -1, -1):
        # An edge is not on a plane whose reflection it sees.
        triangle, x, y, z = reflection(surfaces, legs.planes[arm, k], legs.images[antenna, arm, k], x, y, z, TOO_NEAR)
        if triangle < 0:
            return False
        if step != 0:
            vertices[where, 0], vertices[where, 1], vertices[where, 2] = x, y, z
            hit[where] = surfaces.faces[triangle]
            where += step
    return True


@compiled(parallel=True)
def _try(surfaces, legs, points, found):
    """Fill ``found`` [arms]."""
    nothing, none = np.empty((0, 3), np.float32), np.empty(0, np.uint32)
    for arm in numba.prange(len(found)):
        for antenna in range(len(legs.last)):
            for point in range(points.shape[1]):
                x, y, z = points[arm, point]
                if not found[arm] and legs.open[antenna, arm]:
                    found[arm] = follow(surfaces, legs, antenna, arm, x, y, z, nothing, none, 0, 0)
