"""The image method: where a chain of planes reflects the wave between two antennas, if there are surfaces.

The source, mirrored at the planes of a chain in turn, gives its images I_1 … I_n. Going backwards from the target
p_{n+1}, reflection k lies where the line from p_{k+1} to I_k meets plane k. If no triangle of that plane is there, the
chain is not a path between the two. Whether something blocks a path is tested later.

Places are in double precision here, since a path is many wavelengths long.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from simulate.rays.core.planes import BLOCK, Planes
from simulate.rays.core.ray_tracer import dr, mi

MARGIN = 1e-6  # Metres by which triangles are enlarged, so that no point is lost between two of them

LANES = 400_000  # Paths solved at a time. This bounds the memory at some 200 MB.

AT_ONCE = 20_000_000  # Combinations of target, chain and source examined at a time. This bounds the memory.


class Combination(NamedTuple):
    """A target, a chain and a source for each lane."""

    target: mi.UInt
    chain: mi.UInt
    source: mi.UInt

    @classmethod
    def of(cls, lane: mi.UInt, chains: int, sources: int, own: mi.UInt | None = None) -> Combination:
        """The combination of each lane's number, in the order of targets, chains and sources.

        If each target has only one source, ``own`` is its index, and ``sources`` is 1.
        """
        # Sizes that are constants would be part of the kernel, and compile it again. Whole numbers divide slowly.
        sources_, both = dr.opaque(mi.Float64, sources), dr.opaque(mi.Float64, chains * sources)
        if not dr.width(lane):
            return cls(lane, lane, lane)
        number = mi.Float64(lane) + 0.5
        target, pair = mi.UInt(number / both), mi.UInt(number / sources_)
        count, of_chain = dr.opaque(mi.UInt, chains), dr.opaque(mi.UInt, sources)
        source = lane - pair * of_chain if own is None else dr.gather(mi.UInt, own, target)
        return cls(target, pair - target * count, source)


def batches(targets: int, chains: int, sources: int) -> Iterator[tuple[int, int]]:
    """The first and the last target, plus one, of batches whose combinations do not exceed ``AT_ONCE``."""
    size = max(1, AT_ONCE // max(1, chains * sources))
    for start in range(0, targets if chains and sources else 0, size):
        yield start, min(start + size, targets)


def pieces(possible: mi.UInt) -> Iterator[mi.UInt]:
    """Numbers of possible combinations, at most ``LANES`` at a time."""
    count = dr.width(possible)
    for first in range(0, count, LANES):
        yield possible if count <= LANES else mi.UInt(possible[first : first + LANES])


def on_device(points: Float[np.ndarray, "... 3"]) -> mi.Point3d:
    """Points as the ray tracer's arrays in double precision, in the order of memory."""
    return mi.Point3d(*(mi.Float64(np.ascontiguousarray(axis)) for axis in points.reshape(-1, 3).T))


class Mirrors:
    """The planes of a scene, and the triangles in each of them, on the ray tracer's device."""

    def __init__(self, planes: Planes):
        self.planes = planes
        self._normals, self._offsets = on_device(planes.normals), mi.Float64(planes.offsets)
        self._first, self._first_box = mi.UInt(planes.first), mi.UInt(planes.first_box)
        self._low, self._high = on_device(planes.boxes[:, 0] - MARGIN), on_device(planes.boxes[:, 1] + MARGIN)
        self._inwards = [on_device(planes.sides[:, side, :3]) for side in range(3)]
        self._least = [mi.Float64(planes.sides[:, side, 3] - MARGIN) for side in range(3)]
        self._faces = mi.UInt(planes.faces)

    def image(self, plane: mi.UInt, point: mi.Point3d) -> mi.Point3d:
        """The image of a point at a plane."""
        normal = dr.gather(mi.Point3d, self._normals, plane)
        return mi.Point3d(point - 2 * (dr.dot(normal, point) - dr.gather(mi.Float64, self._offsets, plane)) * normal)

    def reflection(
        self, plane: mi.UInt, image: mi.Point3d, point: mi.Point3d, nearest: float, active: mi.Bool
    ) -> tuple[mi.Bool, mi.UInt, mi.Point3d]:
        """Whether a plane has a surface that reflects the wave from an image to a point, its triangle, and where.

        A point that is nearer to the plane than ``nearest``, metres, sees no reflection.
        """
        normal = dr.gather(mi.Point3d, self._normals, plane, active)
        way = image - point
        towards = dr.dot(normal, way)
        distance = dr.gather(mi.Float64, self._offsets, plane, active) - dr.dot(normal, point)
        # The plane must lie between the point and the image.
        active = active & (distance * towards > 0) & (dr.abs(distance) < dr.abs(towards))
        active &= dr.abs(distance) >= nearest
        place = mi.Point3d(point + dr.select(active, distance / towards, 0) * way)
        face, found = self._on_surface(plane, place, active)
        return found, face, place

    @dr.syntax
    def _on_surface(self, plane: mi.UInt, point: mi.Point3d, active: mi.Bool) -> tuple[mi.UInt, mi.Bool]:
        """The first triangle of a plane that contains a point of the plane, to within ``MARGIN``, if there is one."""
        triangle = dr.gather(mi.UInt, self._first, plane, active)
        stop = dr.gather(mi.UInt, self._first, plane + 1, active)
        box = dr.gather(mi.UInt, self._first_box, plane, active)
        step, found, running = mi.UInt(0), mi.Bool(False), mi.Bool(active)
        while running:
            begins = running & (step % BLOCK == 0)
            low, high = (dr.gather(mi.Point3d, corner, box, begins) for corner in (self._low, self._high))
            outside = begins & (dr.any(point < low) | dr.any(point > high))
            inside = running & ~outside
            for inwards, least in zip(self._inwards, self._least, strict=True):
                side = dr.dot(dr.gather(mi.Point3d, inwards, triangle, inside), point)
                inside &= side >= dr.gather(mi.Float64, least, triangle, inside)
            found |= inside
            running &= ~found
            ahead = dr.select(outside, BLOCK, 1)
            step = dr.select(running, step + ahead, step)
            triangle = dr.select(running, triangle + ahead, triangle)
            box = dr.select(running & (step % BLOCK == 0), box + 1, box)
            running &= triangle < stop
        return dr.gather(mi.UInt, self._faces, triangle, found), found


def mirrored(
    planes: Planes, sequences: Int[np.ndarray, "sequences most"], sources: Float[np.ndarray, "sources 3"]
) -> Float[np.ndarray, "most+1 sources sequences 3"]:
    """Sources mirrored at no plane, the first plane, the first two planes, and so on; after the last one as before."""
    images = np.empty((sequences.shape[1] + 1, len(sources), len(sequences), 3))
    images[0] = sources[:, None]
    for k, plane in enumerate(sequences.T):
        normals, offsets = planes.normals[plane], planes.offsets[plane]
        distance = (np.einsum("nsi,si->ns", images[k], normals) - offsets) * (plane >= 0)
        images[k + 1] = images[k] - 2 * distance[..., None] * normals
    return images
