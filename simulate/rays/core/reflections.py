"""A quick test of which chains can be paths: is there a surface where the image method puts each reflection?

The source, mirrored at the planes of a chain in turn, gives its images I_1 … I_n. Going backwards from the target
p_{n+1}, reflection k lies where the line from p_{k+1} to I_k meets plane k. If no triangle of that plane is there, the
chain is not a path between the two. In a furnished room most combinations fail this test, which costs much less than an
exact solution. The test never drops a path. The exact solution later tests whether something blocks the path.
"""

from __future__ import annotations

import numba
import numpy as np
from jaxtyping import Float, Int

from simulate.parallel import ONE_KERNEL
from simulate.parallel.compiled import compiled
from simulate.rays.core.planes import BLOCK, Planes

MARGIN = 0.01
"""Metres by which triangles are enlarged, so that rounding never drops a path."""

AT_ONCE = 50_000_000
"""Combinations tested at a time, one byte each."""


def possible_paths(
    planes: Planes,
    chains: Int[np.ndarray, "chains depth"],
    sources: Float[np.ndarray, "sources 3"],
    targets: Float[np.ndarray, "targets 3"],
) -> Int[np.ndarray, "3 paths"]:
    """Combinations (target, chain, source) whose reflections all lie on a surface, in lexical order.

    Args:
        planes: the scene's planes.
        chains: reflecting planes from source to target; −1 for an interaction that does not change the direction.
        sources: positions of the sources, metres, world frame.
        targets: positions of the targets, metres, world frame.

    Returns:
        Indices of the target, the chain and the source of each combination.
    """
    order = np.argsort(chains < 0, axis=1, kind="stable")
    reflecting = np.take_along_axis(chains, order, axis=1)
    count = (chains >= 0).sum(axis=1)
    images = np.empty((len(chains), len(sources), chains.shape[1], 3))
    mirror(planes.normals, planes.offsets, reflecting, count, sources, images)
    batch_size = max(1, AT_ONCE // max(1, len(chains) * len(sources)))
    found = [np.zeros((3, 0), np.int64)]
    for start in range(0, len(targets), batch_size):
        batch_targets = targets[start : start + batch_size]
        possible = np.zeros((len(batch_targets), len(chains), len(sources)), dtype=np.bool_)
        surfaces = planes.normals, planes.offsets, planes.first, planes.sides, planes.first_box, planes.boxes
        with ONE_KERNEL:
            _backtrack(*surfaces, reflecting, count, images, batch_targets, possible)
        target, chain, source = np.nonzero(possible)
        found.append(np.stack([target + start, chain, source]))
    return np.concatenate(found, axis=1)


@compiled
def mirror(normals, offsets, chains, count, sources, images):
    """Fill ``images`` [chains, sources, depth, 3]: image k is image k − 1 mirrored at plane k."""
    for chain in range(len(chains)):
        for source in range(len(sources)):
            x, y, z = sources[source]
            for k in range(count[chain]):
                plane = chains[chain, k]
                nx, ny, nz = normals[plane]
                twice = 2 * (nx * x + ny * y + nz * z - offsets[plane])
                x, y, z = x - twice * nx, y - twice * ny, z - twice * nz
                images[chain, source, k] = x, y, z


@compiled(inline="always")
def on_surface(first, sides, first_box, boxes, plane, x, y, z, margin):
    """The first triangle of a plane that contains a point of the plane, within a margin; −1 if there is none."""
    for box in range(first_box[plane], first_box[plane + 1]):
        (x0, y0, z0), (x1, y1, z1) = boxes[box]
        if not (
            x0 - margin <= x <= x1 + margin and y0 - margin <= y <= y1 + margin and z0 - margin <= z <= z1 + margin
        ):
            continue
        begin = first[plane] + BLOCK * (box - first_box[plane])
        for triangle in range(begin, min(begin + BLOCK, first[plane + 1])):
            inside = True
            for side in range(3):
                ex, ey, ez, least = sides[triangle, side]
                inside = inside and ex * x + ey * y + ez * z >= least - margin
            if inside:
                return triangle
    return -1


@compiled(parallel=True)
def _backtrack(normals, offsets, first, sides, first_box, boxes, chains, count, images, targets, possible):
    """Fill ``possible`` [targets, chains, sources]."""
    for target in numba.prange(len(targets)):
        for chain in range(len(chains)):
            for source in range(images.shape[1]):
                x, y, z = targets[target]
                on_surfaces = True
                for k in range(count[chain] - 1, -1, -1):
                    plane = chains[chain, k]
                    nx, ny, nz = normals[plane]
                    ix, iy, iz = images[chain, source, k]
                    dx, dy, dz = ix - x, iy - y, iz - z
                    towards = nx * dx + ny * dy + nz * dz
                    distance = offsets[plane] - (nx * x + ny * y + nz * z)
                    # The plane must lie between the point and the image.
                    if distance * towards <= 0 or abs(distance) >= abs(towards):
                        on_surfaces = False
                        break
                    share = distance / towards
                    x, y, z = x + share * dx, y + share * dy, z + share * dz
                    if on_surface(first, sides, first_box, boxes, plane, x, y, z, MARGIN) < 0:
                        on_surfaces = False
                        break
                possible[target, chain, source] = on_surfaces
