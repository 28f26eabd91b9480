"""Solids and sheets for the objects of a scene, as triangle meshes in metres."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import trimesh
from jaxtyping import Float
from scipy.spatial.transform import Rotation
from trimesh import Trimesh

Vector3 = Sequence[float] | np.ndarray


def bounding_box(points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "2 3"]:
    """Lowest and highest corner of the axis-aligned box around points.

    Args:
        points: metres.

    Returns:
        The two corners, metres.

    >>> bounding_box(np.array([[0.0, 2.0, 1.0], [1.0, 0.0, 1.0]])).tolist()
    [[0.0, 0.0, 1.0], [1.0, 2.0, 1.0]]
    """
    return np.stack([points.min(axis=0), points.max(axis=0)])


def box(low: Vector3, high: Vector3) -> Trimesh:
    """Closed axis-aligned box between two corners: 8 vertices, 12 triangles, normals outwards.

    Args:
        low: lowest corner, metres.
        high: highest corner, metres.

    >>> float(box((0, 0, 0), (2, 1, 0.5)).volume)
    1.0
    """
    return trimesh.creation.box(bounds=np.array([low, high], dtype=float))


def sheet(corner: Vector3, u: Vector3, v: Vector3, openings: Sequence[Sequence[float]] = ()) -> Trimesh:
    """Rectangle corner + s·u + t·v, s and t in [0, 1], one triangle thick, normal along u × v.

    Args:
        corner: metres.
        u: one side, metres.
        v: the other side, perpendicular to u, metres.
        openings: rectangles left out, each (s0, s1, t0, t1) in metres along u and v from the corner; they must not
            overlap.

    Returns:
        The sheet; no two of its triangles overlap.

    >>> wall = sheet((0, 0, 0), (4, 0, 0), (0, 0, 2.5), openings=[(1, 2, 0, 2)])  # with a door of 1 x 2 metres
    >>> float(wall.area)
    8.0
    """
    width, height = float(np.linalg.norm(u)), float(np.linalg.norm(v))
    # Cut along every edge of every opening and keep the cells that lie in none: no overlap, no T-junction.
    s_cuts = sorted({0.0, width, *(s for o in openings for s in o[:2])})
    t_cuts = sorted({0.0, height, *(t for o in openings for t in o[2:])})
    cells = [
        (s, t)
        for s in pairwise(s_cuts)
        for t in pairwise(t_cuts)
        if not any(s0 < sum(s) / 2 < s1 and t0 < sum(t) / 2 < t1 for s0, s1, t0, t1 in openings)
    ]
    corners = [(s, t) for (s0, s1), (t0, t1) in cells for s, t in ((s0, t0), (s1, t0), (s1, t1), (s0, t1))]
    vertices = np.asarray(corner) + np.array(corners) / [width, height] @ np.array([u, v], dtype=float)
    faces = np.concatenate([[[k, k + 1, k + 2], [k, k + 2, k + 3]] for k in range(0, len(vertices), 4)])
    mesh = Trimesh(vertices, faces, process=False)
    mesh.merge_vertices()
    return mesh


def union(*parts: Trimesh) -> Trimesh:
    """Several parts as one mesh; parts that touch stay separate shells, so leave a gap between them.

    Args:
        parts: at least one mesh.

    >>> len(union(box((0, 0, 0), (1, 1, 1)), sheet((0, 0, 2), (1, 0, 0), (0, 1, 0))).faces)
    14
    """
    offsets = np.cumsum([0, *(len(p.vertices) for p in parts[:-1])])
    faces = [p.faces + offset for p, offset in zip(parts, offsets, strict=True)]
    return Trimesh(np.vstack([p.vertices for p in parts]), np.vstack(faces), process=False)


def rotate(mesh: Trimesh, degrees: float) -> Trimesh:
    """A copy that is rotated about the vertical through its centre.

    Args:
        mesh: the mesh, which stays as it is.
        degrees: counterclockwise, seen from above.

    >>> rotate(box((0, 0, 0), (4, 2, 1)), 90).extents.round(6).tolist()
    [2.0, 4.0, 1.0]
    """
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_euler("z", degrees, degrees=True).as_matrix()
    centre = mesh.bounds.mean(axis=0)
    matrix[:3, 3] = centre - matrix[:3, :3] @ centre
    return mesh.copy().apply_transform(matrix)
