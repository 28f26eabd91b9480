"""Points in the cylindrical coordinates (ρ, φ, z) of an edge: z from its start along it, φ from face 0 on.

All functions take single numbers and tuples of numbers, not arrays, since numba counts references to arrays at every
call. A wedge is a tuple here: start, direction, normal and tangent of face 0, length, exterior angle (``Edges``).
"""

from __future__ import annotations

import numpy as np

from simulate.parallel.compiled import compiled


@compiled
def wedge_of(wedges, edge):
    """An edge as a tuple: start, direction, normal and tangent of face 0, length, exterior angle."""
    return (
        (wedges.starts[edge, 0], wedges.starts[edge, 1], wedges.starts[edge, 2]),
        (wedges.directions[edge, 0], wedges.directions[edge, 1], wedges.directions[edge, 2]),
        (wedges.normals[edge, 0], wedges.normals[edge, 1], wedges.normals[edge, 2]),
        (wedges.tangents[edge, 0], wedges.tangents[edge, 1], wedges.tangents[edge, 2]),
        wedges.lengths[edge],
        wedges.exterior[edge],
    )


@compiled
def dot(a, b):
    """a·b of two vectors."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compiled
def minus(a, b):
    """a − b of two vectors."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@compiled
def distance(a, b):
    """|a − b| of two points."""
    way = minus(a, b)
    return np.sqrt(dot(way, way))


@compiled
def cross(a, b):
    """a × b of two vectors."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@compiled
def hypotenuse(a, b):
    """√(a² + b²). np.hypot is slower, since it avoids overflow."""
    return np.sqrt(a * a + b * b)


@compiled
def about(wedge, point):
    """Cylindrical coordinates z and ρ of a point about an edge."""
    offset = minus(point, wedge[0])
    along = dot(offset, wedge[1])
    return along, np.sqrt(max(dot(offset, offset) - along * along, 0.0))


@compiled
def angle_about(wedge, point):
    """Angle φ of a point about an edge, from face 0 on."""
    offset = minus(point, wedge[0])
    return np.arctan2(dot(offset, wedge[2]), dot(offset, wedge[3])) % (2 * np.pi)


@compiled
def on_edge(wedge, along):
    """The point of an edge's line at a distance from its start."""
    start, direction = wedge[0], wedge[1]
    return start[0] + along * direction[0], start[1] + along * direction[1], start[2] + along * direction[2]


@compiled
def on_edge_or_end(wedge, along):
    """The point of an edge that is nearest to a point of its line."""
    return on_edge(wedge, min(max(along, 0.0), wedge[4]))


@compiled
def diffraction_point(z1, rho1, z2, rho2, length):
    """z, and how much longer the ways through the start and the end of the edge are; negative if z lies beyond."""
    z = z1 + (z2 - z1) * rho1 / (rho1 + rho2)
    shortest = hypotenuse(rho1 + rho2, z2 - z1)
    by_start = hypotenuse(rho1, z1) + hypotenuse(rho2, z2) - shortest
    by_end = hypotenuse(rho1, z1 - length) + hypotenuse(rho2, z2 - length) - shortest
    return z, by_start if z >= 0 else -by_start, by_end if z <= length else -by_end
