"""Triangle meshes for the objects of a scene: boxes, sheets with openings, unions and rotations.

All lengths are in metres, in the world frame with z up. Shapes are ``trimesh.Trimesh`` objects.

Example:
    >>> import bisplat
    >>> wall = bisplat.shapes.sheet((0, 0, 0), (4, 0, 0), (0, 0, 2.5), openings=[(1, 2, 0, 2)])
    >>> bisplat.SceneObject("wall", wall, "brick").name
    'wall'
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import trimesh
from jaxtyping import Float
from scipy.spatial.transform import Rotation
from trimesh import Trimesh

from scenes.files.errors import ParameterError, check_array, require_instance, require_within

Vector3 = Sequence[float] | np.ndarray

ROUNDING = 1e-6  # Metres by which an opening may reach over the edge of its sheet

SKEW = 0.01
"""Largest cosine of the angle between the sides of a sheet. Rounded coordinates make small ones."""

MOST_DEGREES = 1e6  # Largest angle of a rotation, degrees


def bounding_box(points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "2 3"]:
    """Return the box around points whose edges are parallel to the axes.

    Args:
        points: points, [n, 3], metres.

    Returns:
        Lowest and highest corner of the box, [2, 3], metres.

    Raises:
        ParameterError: the points are not rows of finite numbers.

    Example:
        >>> import bisplat, numpy as np
        >>> bisplat.shapes.bounding_box(np.array([[0.0, 2.0, 1.0], [1.0, 0.0, 1.0]])).tolist()
        [[0.0, 0.0, 1.0], [1.0, 2.0, 1.0]]
    """
    points = check_array("points", points, (None, None), "rows of coordinates")
    if not len(points):
        raise ParameterError("points", "expected at least one point, found none")
    return np.stack([points.min(axis=0), points.max(axis=0)])


def box(low: Vector3, high: Vector3) -> Trimesh:
    """Make a closed box whose edges are parallel to the axes.

    Args:
        low: corner with the lowest coordinates, [3], metres.
        high: corner with the highest coordinates, [3], metres.

    Returns:
        A mesh of 8 vertices and 12 triangles whose normals point outwards.

    Raises:
        ParameterError: a corner is not three finite numbers, or ``low`` is not below ``high``.

    Example:
        >>> import bisplat
        >>> cabinet = bisplat.shapes.box((0, 0, 0), (2, 1, 0.5))
        >>> float(cabinet.volume), len(cabinet.faces)
        (1.0, 12)
    """
    low, high = (check_array(name, corner, (3,), "a corner x, y, z") for name, corner in (("low", low), ("high", high)))
    if not (low < high).all():
        raise ParameterError("low", f"expected a corner below high, {high.tolist()}, found {low.tolist()}")
    return trimesh.creation.box(bounds=np.array([low, high]))


def sheet(corner: Vector3, u: Vector3, v: Vector3, openings: Sequence[Sequence[float]] = ()) -> Trimesh:
    """Make a rectangular sheet, with openings if needed: a wall, a floor, a board.

    The sheet consists of the points corner + s u + t v with s and t from 0 to 1. It is a surface without thickness; its
    material, or ``SceneObject.thickness``, has the thickness of the slab that it stands for.

    Args:
        corner: one corner, [3], metres.
        u: vector along one side, [3], metres.
        v: vector along the other side, [3], metres, perpendicular to u.
        openings: rectangles left out of the sheet, such as doors and windows: each (s0, s1, t0, t1), the distances
            from the corner along u and along v, metres. They must not overlap.

    Returns:
        A mesh whose normals point along u × v. No two of its triangles overlap.

    Raises:
        ParameterError: a vector is not three finite numbers, the sheet has no area, or an opening is not inside it.

    Example:
        A wall of 4 × 2.5 m with a door of 1 × 2 m:

        >>> import bisplat
        >>> wall = bisplat.shapes.sheet((0, 0, 0), (4, 0, 0), (0, 0, 2.5), openings=[(1, 2, 0, 2)])
        >>> float(wall.area)
        8.0
    """
    given = {"corner": corner, "u": u, "v": v}
    corner, u, v = (check_array(name, vector, (3,), "a vector x, y, z") for name, vector in given.items())
    if not np.linalg.norm(np.cross(u, v)) > 0:
        raise ParameterError("v", f"expected a vector across u, {u.tolist()}, found {v.tolist()}")
    width, height = float(np.linalg.norm(u)), float(np.linalg.norm(v))
    if abs(np.dot(u, v)) > SKEW * width * height:
        raise ParameterError("v", f"expected a vector perpendicular to u, {u.tolist()}, found {v.tolist()}")
    openings = _checked_openings(openings, width, height)
    # Cut along every edge of every opening and keep the cells outside the openings: no overlaps, no T-junctions.
    s_cuts = sorted({0.0, width, *(s for o in openings for s in o[:2])})
    t_cuts = sorted({0.0, height, *(t for o in openings for t in o[2:])})
    cells = [
        (s, t)
        for s in pairwise(s_cuts)
        for t in pairwise(t_cuts)
        if not any(s0 < sum(s) / 2 < s1 and t0 < sum(t) / 2 < t1 for s0, s1, t0, t1 in openings)
    ]
    if not cells:
        raise ParameterError("openings", "expected openings that leave something of the sheet, found none left")
    corners = [(s, t) for (s0, s1), (t0, t1) in cells for s, t in ((s0, t0), (s1, t0), (s1, t1), (s0, t1))]
    vertices = np.asarray(corner) + np.array(corners) / [width, height] @ np.array([u, v], dtype=float)
    faces = np.concatenate([[[k, k + 1, k + 2], [k, k + 2, k + 3]] for k in range(0, len(vertices), 4)])
    mesh = Trimesh(vertices, faces, process=False)
    mesh.merge_vertices()
    return mesh


def _checked_openings(openings: Sequence[Sequence[float]], width: float, height: float) -> list[list[float]]:
    """The openings, which must be inside the sheet. Ends within ``ROUNDING`` of an edge of it are moved to the edge."""
    if isinstance(openings, Sequence) and not openings:
        return []
    found = check_array("openings", openings, (None, 4), "rows of s0, s1, t0, t1")
    ends, sides = found.reshape(-1, 2, 2), np.array([width, height])
    inside = (ends[..., 0] >= -ROUNDING) & (ends[..., 0] < ends[..., 1]) & (ends[..., 1] <= sides + ROUNDING)
    if not inside.all():
        wrong = found[int(np.flatnonzero(~inside.all(axis=1))[0])].tolist()
        raise ParameterError("openings", f"expected ends within 0 to {width:g} and 0 to {height:g} m, found {wrong}")
    ends = np.where(np.abs(ends) < ROUNDING, 0.0, ends)
    last = sides[:, None]  # of both ends along u, and of both along v
    return np.where(np.abs(ends - last) < ROUNDING, last, ends).reshape(-1, 4).tolist()


def union(*parts: Trimesh) -> Trimesh:
    """Join several meshes into one.

    The triangles stay as they are; this is not a Boolean union. Leave a small gap, such as 2 mm, between parts that
    would touch: rays hit coincident surfaces in an arbitrary order.

    Args:
        parts: at least one mesh.

    Returns:
        A mesh with the triangles of all parts.

    Raises:
        ParameterError: there are no parts, or one is not a mesh.

    Example:
        >>> import bisplat
        >>> crate = bisplat.shapes.box((0, 0, 0), (1, 1, 1))
        >>> lid = bisplat.shapes.sheet((0, 0, 1.1), (1, 0, 0), (0, 1, 0))
        >>> len(bisplat.shapes.union(crate, lid).faces)
        14
    """
    if not parts:
        raise ParameterError("parts", "expected at least one mesh, found none")
    for part in parts:
        require_instance(Trimesh, parts=part)
    offsets = np.cumsum([0, *(len(p.vertices) for p in parts[:-1])])
    faces = [p.faces + offset for p, offset in zip(parts, offsets, strict=True)]
    return Trimesh(np.vstack([p.vertices for p in parts]), np.vstack(faces), process=False)


def rotate(mesh: Trimesh, degrees: float) -> Trimesh:
    """Rotate a mesh about the vertical line through the centre of its bounding box.

    Args:
        mesh: the mesh, which is not changed.
        degrees: angle of the rotation, degrees, counterclockwise as seen from above.

    Returns:
        The rotated copy.

    Raises:
        ParameterError: the mesh is none, or the angle is not a finite number.

    Example:
        >>> import bisplat
        >>> table = bisplat.shapes.box((0, 0, 0), (4, 2, 1))
        >>> bisplat.shapes.rotate(table, 90).extents.round(6).tolist()
        [2.0, 4.0, 1.0]
    """
    require_instance(Trimesh, mesh=mesh)
    require_within(-MOST_DEGREES, MOST_DEGREES, "an angle in degrees", degrees=degrees)
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_euler("z", degrees, degrees=True).as_matrix()
    centre = mesh.bounds.mean(axis=0)
    matrix[:3, 3] = centre - matrix[:3, :3] @ centre
    return mesh.copy().apply_transform(matrix)
