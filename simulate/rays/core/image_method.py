"""The image method: where a chain of planes reflects the wave between two antennas, if there are surfaces.

The source, mirrored at the planes of a chain in turn, gives its images I_1 … I_n. Going backwards from the target
p_{n+1}, reflection k lies where the line from p_{k+1} to I_k meets plane k. If no triangle of that plane is there, the
chain is not a path between the two. Whether something blocks a path is tested later.
"""

from __future__ import annotations

import numba
import numpy as np
from jaxtyping import Float, Int

from simulate.parallel.compiled import ONE_KERNEL, compiled
from simulate.rays.core.electric_field import Ways, aligned
from simulate.rays.core.planes import BLOCK, Planes

MARGIN = 1e-6  # Metres by which triangles are enlarged, so that no point is lost between two of them

AT_ONCE = 50_000_000  # Combinations tested at a time, one byte each


class Images:
    """The images of sources by chains with equal numbers of reflections."""

    def __init__(
        self,
        planes: Planes,
        chains: Int[np.ndarray, "chains reflections"],
        sources: Float[np.ndarray, "sources 3"],
    ):
        self._planes, self._chains, self._sources = planes, chains, sources
        self._images = np.empty((len(chains), len(sources), chains.shape[1], 3))
        count = np.full(len(chains), chains.shape[1])
        mirror(planes.normals, planes.offsets, chains, count, sources, self._images)
        self._arrays = planes.arrays, chains, self._images

    def possible_paths(self, targets: Float[np.ndarray, "targets 3"]) -> Int[np.ndarray, "3 paths"]:
        """Combinations (target, chain, source) whose reflections all lie on a surface, in lexical order."""
        batch = max(1, AT_ONCE // max(1, len(self._chains) * len(self._sources)))
        found = [np.zeros((3, 0), np.int64)]
        for start in range(0, len(targets), batch):
            some = targets[start : start + batch]
            possible = np.zeros((len(some), len(self._chains), len(self._sources)), dtype=np.bool_)
            with ONE_KERNEL:
                _mark(*self._arrays, some, possible)  # type: ignore[call-arg]
            target, chain, source = np.nonzero(possible)
            found.append(np.stack([target + start, chain, source]))
        return np.concatenate(found, axis=1)

    def ways(self, paths: Int[np.ndarray, "3 paths"], targets: Float[np.ndarray, "targets 3"]) -> Ways:
        """The ways of some of the possible paths."""
        count, reflections = paths.shape[1], self._chains.shape[1]
        vertices, faces = aligned(np.float32, reflections, 3, count), aligned(np.uint32, reflections, count)
        with ONE_KERNEL:
            _place(*self._arrays, targets, paths, vertices, faces)  # type: ignore[call-arg]
        target, chain, source = paths
        last = self._images[chain, source, -1] if reflections else self._sources[source]
        length = np.linalg.norm(targets[target] - last, axis=1)
        sources_, targets_ = aligned(np.uint32, count), aligned(np.uint32, count)
        sources_[:], targets_[:] = source, target
        return Ways(sources_, targets_, vertices, faces, length, 1 / length)


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
def on_surface(surfaces, plane, x, y, z):
    """The first triangle of a plane that contains a point of the plane, to within ``MARGIN``; −1 if there is none."""
    for box in range(surfaces.first_box[plane], surfaces.first_box[plane + 1]):
        (x0, y0, z0), (x1, y1, z1) = surfaces.boxes[box]
        if not (
            x0 - MARGIN <= x <= x1 + MARGIN and y0 - MARGIN <= y <= y1 + MARGIN and z0 - MARGIN <= z <= z1 + MARGIN
        ):
            continue
        begin = surfaces.first[plane] + BLOCK * (box - surfaces.first_box[plane])
        for triangle in range(begin, min(begin + BLOCK, surfaces.first[plane + 1])):
            inside = True
            for side in range(3):
                ex, ey, ez, least = surfaces.sides[triangle, side]
                inside = inside and ex * x + ey * y + ez * z >= least - MARGIN
            if inside:
                return triangle
    return -1


@compiled(inline="always")
def reflection(surfaces, plane, image, x, y, z, nearest):
    """The triangle that reflects the wave from an image to a point, −1 if there is none, and where it does.

    A point that is nearer to the plane than ``nearest``, metres, sees no reflection.
    """
    nx, ny, nz = surfaces.normals[plane]
    ix, iy, iz = image
    dx, dy, dz = ix - x, iy - y, iz - z
    towards = nx * dx + ny * dy + nz * dz
    distance = surfaces.offsets[plane] - (nx * x + ny * y + nz * z)
    # The plane must lie between the point and the image.
    if distance * towards <= 0 or abs(distance) >= abs(towards) or abs(distance) < nearest:
        return -1, x, y, z
    share = distance / towards
    x, y, z = x + share * dx, y + share * dy, z + share * dz
    return on_surface(surfaces, plane, x, y, z), x, y, z


@compiled(parallel=True)
def _mark(surfaces, chains, images, targets, possible):
    """Fill ``possible`` [targets, chains, sources]."""
    for target in numba.prange(len(targets)):
        for chain in range(len(chains)):
            for source in range(images.shape[1]):
                x, y, z = targets[target]
                triangle = 0
                for k in range(chains.shape[1] - 1, -1, -1):
                    triangle, x, y, z = reflection(surfaces, chains[chain, k], images[chain, source, k], x, y, z, 0.0)
                    if triangle < 0:
                        break
                possible[target, chain, source] = triangle >= 0


@compiled(parallel=True)
def _place(surfaces, chains, images, targets, paths, vertices, hit):
    """Fill ``vertices`` [reflections, 3, paths] and ``hit`` [reflections, paths]."""
    for path in numba.prange(paths.shape[1]):
        target, chain, source = paths[0, path], paths[1, path], paths[2, path]
        x, y, z = targets[target]
        for k in range(chains.shape[1] - 1, -1, -1):
            triangle, x, y, z = reflection(surfaces, chains[chain, k], images[chain, source, k], x, y, z, 0.0)
            vertices[k, 0, path], vertices[k, 1, path], vertices[k, 2, path] = x, y, z
            hit[k, path] = surfaces.faces[triangle]
