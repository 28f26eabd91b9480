"""The length by which the slabs on a path shorten it.

The coefficients of a slab [itu2023] refer to its faces: transmission from face to face, reflection at the front. The
length of a path, however, is counted to the surface, which has no thickness. A wave that passes through a slab of
thickness t at the angle of incidence θ travels t cos θ of its length inside the slab, and the transmission coefficient
counts this, too. A wave that is reflected at a slab whose front lies f before the surface turns back earlier, and its
way is 2 f cos θ shorter.
"""

from __future__ import annotations

import numba
import numpy as np
from jaxtyping import Float, Int

from simulate.parallel.compiled import compiled


@compiled(parallel=True)
def find_shortening(
    reflected: Int[np.ndarray, "paths depth"],
    passed: Int[np.ndarray, "paths depth"],
    faces: Int[np.ndarray, "paths depth"],
    vertices: Float[np.ndarray, "paths depth 3"],
    starts: Float[np.ndarray, "paths 3"],
    normals: Float[np.ndarray, "faces 3"],
    fronts: Float[np.ndarray, "faces 2"],
) -> Float[np.ndarray, " paths"]:
    """Metres by which each path is shorter than its vertices say.

    Args:
        reflected: whether each interaction is a reflection.
        passed: whether each interaction is a transmission.
        faces: number of the triangle of each interaction, counted through the scene's objects.
        vertices: places of the interactions, metres.
        starts: where the paths begin, metres.
        normals: unit normals of the triangles.
        fronts: fronts of the triangles' slabs (``FaceSlabs``), metres.
    """
    result = np.zeros(len(starts))
    for path in numba.prange(len(starts)):
        x, y, z = starts[path]
        for number in range(reflected.shape[1]):
            if not (reflected[path, number] or passed[path, number]):
                continue
            face = faces[path, number]
            dx, dy, dz = vertices[path, number, 0] - x, vertices[path, number, 1] - y, vertices[path, number, 2] - z
            x, y, z = vertices[path, number]
            length = np.sqrt(dx * dx + dy * dy + dz * dz)
            cosine = (dx * normals[face, 0] + dy * normals[face, 1] + dz * normals[face, 2]) / max(length, 1e-9)
            if reflected[path, number]:
                result[path] += 2 * fronts[face, 0 if cosine < 0 else 1] * abs(cosine)
            else:
                result[path] += (fronts[face, 0] + fronts[face, 1]) * abs(cosine)
    return result
