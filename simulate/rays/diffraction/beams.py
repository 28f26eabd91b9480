"""The edges that the beams of reflected waves may meet, and how strong the waves behind them promise to be.

A beam is all waves that one sequence of planes reflects from some antennas.
"""

from __future__ import annotations

import numba
import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import cKDTree

from simulate.parallel.compiled import ONE_KERNEL, compiled
from simulate.rays.core.planes import Planes
from simulate.rays.core.shooting import Explored
from simulate.rays.diffraction.diffraction_points import TOO_NEAR
from simulate.rays.diffraction.edges import Edges
from simulate.rays.diffraction.passing_rays import squared_distance

BLOCK = 16  # Number of edges that a beam passes at once


@compiled
def promise_of(wavelength, before, behind):
    """About how strong a wave is behind an edge, at given distances (metres) from it, over λ/4π.

    It is about √λ/2π / √(d₁ d₂ (d₁ + d₂)) with the edge's distances d₁ and d₂ from the antennas.
    """
    first, second = np.maximum(before, wavelength), np.maximum(behind, wavelength)
    return np.sqrt(wavelength / (first * second * (first + second))) / (2 * np.pi)


def in_beams(
    wavelength: float,
    planes: Planes,
    edges: Edges,
    explored: Explored,
    images: Float[np.ndarray, "sequences 3"],
    antennas: Float[np.ndarray, "antennas 3"],
    behind: Float[np.ndarray, " edges"],
    least: float,
) -> tuple[Int[np.ndarray, " arms"], Int[np.ndarray, " arms"], Float[np.ndarray, " arms"]]:
    """The sequences and edges for which some antenna's wave, off the box of the last plane, may meet the edge.

    ``images`` are those of the antennas' middle. With the arms comes how strong their waves promise to be.
    """
    sequences = explored.short
    radius = float(np.linalg.norm(antennas - antennas.mean(axis=0), axis=1).max())
    padded = np.column_stack([np.full(len(sequences), -1), sequences])
    plane = padded[np.arange(len(sequences)), (sequences >= 0).sum(axis=1)]
    mirrors = planes.normals, planes.offsets, planes.low, planes.high
    ends = edges.starts, edges.starts + edges.lengths[:, None] * edges.directions, edges.directions, edges.lengths
    # Edges that are near each other make a block, so that a beam passes most of them at once.
    order = cKDTree((ends[0] + ends[1]) / 2, leafsize=BLOCK).indices
    firsts = np.arange(0, len(edges), BLOCK)
    low, high = (
        np.minimum.reduceat(np.minimum(ends[0], ends[1])[order], firsts),
        np.maximum.reduceat(np.maximum(ends[0], ends[1])[order], firsts),
    )
    blocks = order, low, high, np.minimum.reduceat(behind[order], firsts)
    beams, count = (images, plane, explored.strengths), np.zeros(len(sequences) + 1, np.int64)
    edge, promise = np.zeros(0, np.int64), np.zeros(0)
    for _ in range(2 if len(edges) else 0):  # counted first, then written
        first = np.cumsum(count)
        edge, promise = np.zeros(first[-1], np.int64), np.zeros(first[-1])
        with ONE_KERNEL:
            _meet_beams(beams, radius, mirrors, blocks, ends, behind, wavelength, least, first, count, edge, promise)
    return np.repeat(np.arange(len(sequences)), count[1:]), edge, promise


@compiled(parallel=True, error_model="numpy")
def _meet_beams(beams, radius, mirrors, blocks, ends, behind, wavelength, least, first, count, edges, promises):
    """Count the edges that each beam may meet. If there is room, write them, and how strong waves promise to be."""
    images, planes, strengths = beams
    normals, offsets, boxes_low, boxes_high = mirrors
    order, low, high, least_behind = blocks
    starts, stops, directions, lengths = ends
    for beam in numba.prange(len(images)):
        image, plane, strength = images[beam], planes[beam], strengths[beam]
        mirror = normals[plane], offsets[plane], boxes_low[plane], boxes_high[plane]
        # The promise is less than strength √(λ/d₂) / (2π d₁).
        bound = strength * np.sqrt(wavelength) / (2 * np.pi * least)
        found = 0
        for block in range(len(low)):
            squared = 0.0
            for axis in range(3):
                squared += max(low[block, axis] - image[axis], image[axis] - high[block, axis], 0.0) ** 2
            if squared > (radius + bound / np.sqrt(least_behind[block])) ** 2:
                continue
            for place in range(block * BLOCK, min((block + 1) * BLOCK, len(order))):
                edge = order[place]
                squared = squared_distance(image, starts[edge], directions[edge], lengths[edge])
                if squared > (radius + bound / np.sqrt(behind[edge])) ** 2:
                    continue
                promise = strength * promise_of(wavelength, max(np.sqrt(squared) - radius, 0.0), behind[edge])
                if promise >= least and (plane < 0 or _in_beam(mirror, starts[edge], stops[edge], image, radius)):
                    if len(edges):
                        edges[first[beam] + found], promises[first[beam] + found] = edge, promise
                    found += 1
        count[beam + 1] = found


@compiled
def _in_beam(mirror, start, end, image, radius):
    """Whether the triangle of an image and an edge meets the box of a plane, enlarged by the antennas' radius."""
    normal, offset, low, high = mirror
    nx, ny, nz = normal[0], normal[1], normal[2]
    image_side = nx * image[0] + ny * image[1] + nz * image[2] - offset
    side = 1.0 if image_side > 0 else -1.0
    depth = abs(image_side)
    first = -side * (nx * start[0] + ny * start[1] + nz * start[2] - offset)
    second = -side * (nx * end[0] + ny * end[1] + nz * end[2] - offset)
    if depth <= radius:  # the plane is between the antennas
        return True
    if first < TOO_NEAR and second < TOO_NEAR:  # behind the mirror
        return False
    far = 0.0
    for axis in range(3):
        far = max(far, abs(start[axis] - image[axis]), abs(end[axis] - image[axis]))
    # How far the other antennas' waves meet the plane from that of their middle, at most.
    margin = TOO_NEAR + radius * (1 + 2 * far / (depth - radius + max(min(first, second), 0.0)))
    for axis in range(3):
        a, b = start[axis], end[axis]
        # The part of the edge that is before the mirror.
        if first < 0:
            a = b + (a - b) * second / (second - first)
        elif second < 0:
            b = a + (b - a) * first / (first - second)
        a = image[axis] + (a - image[axis]) * depth / (depth + max(first, 0.0))
        b = image[axis] + (b - image[axis]) * depth / (depth + max(second, 0.0))
        if max(a, b) < low[axis] - margin or min(a, b) > high[axis] + margin:
            return False
    return True
