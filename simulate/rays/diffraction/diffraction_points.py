"""Where the shortest way between two antennas' images, by one edge or two, touches the edges.

Points are in the cylindrical coordinates (ρ, φ, z) of an edge: z from its start along it, φ from face 0 on.
All functions take single numbers and tuples of numbers, not arrays, since numba counts references to arrays at every
call. A wedge is a tuple here: start, direction, normal and tangent of face 0, length, exterior angle (``Edges``).
"""

from __future__ import annotations

import numpy as np

from simulate.parallel.compiled import compiled
from simulate.rays.diffraction.arms import TOO_NEAR
from simulate.rays.diffraction.diffraction_chains import THROUGH_SPACE


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


REACH = 0.5  # Wavelengths. Ends with a longer detour have no effect.

CORNER = 1 / 50
"""Wavelengths. A point of diffraction that is nearer to the line of the other edge is at their common corner."""

ROUNDS = 12  # Most steps of Newton's method. Five or six suffice.

CONVERGED = 1e-7
"""Metres. Newton's method ends at a shorter step, since the next step is of the order of its square."""


@compiled
def _two_points(first, second, source, target):
    """The points along two edges for which the way from source to target is shortest; nan if the method fails."""
    z1, rho1 = about(first, source)
    z2, rho2 = about(second, target)
    between = minus(second[0], first[0])
    between_d, between_e = dot(between, first[1]), dot(between, second[1])
    parallel, square = dot(first[1], second[1]), dot(between, between)
    # Begin where Keller's cone holds for the middle of the other edge.
    along, away = about(first, on_edge(second, second[4] / 2))
    s = z1 + (along - z1) * rho1 / (rho1 + away)
    along, away = about(second, on_edge(first, s))
    t = z2 + (along - z2) * rho2 / (rho2 + away)
    for _ in range(ROUNDS):
        a, b = hypotenuse(rho1, s - z1), hypotenuse(rho2, t - z2)
        c = np.sqrt(max(square + s * s + t * t - 2 * s * t * parallel - 2 * s * between_d + 2 * t * between_e, 1e-12))
        cs, ct = (s - t * parallel - between_d) / c, (t - s * parallel + between_e) / c
        slope_s, slope_t = (s - z1) / a + cs, (t - z2) / b + ct
        ss = rho1**2 / a**3 + (1 - cs * cs) / c
        tt = rho2**2 / b**3 + (1 - ct * ct) / c
        st = -(parallel + cs * ct) / c
        determinant = ss * tt - st * st
        if determinant <= 0:
            return np.nan, np.nan
        step_s, step_t = (tt * slope_s - st * slope_t) / determinant, (ss * slope_t - st * slope_s) / determinant
        s, t = s - min(max(step_s, -1.0), 1.0), t - min(max(step_t, -1.0), 1.0)
        if abs(step_s) + abs(step_t) < CONVERGED:
            return s, t
    return np.nan, np.nan


@compiled
def shortest(first, second, twice, face, source, target):
    """The points of diffraction along the edges of a chain; nan if no wave goes from edge to edge."""
    if not twice:
        z1, rho1 = about(first, source)
        z2, rho2 = about(first, target)
        s = z1 + (z2 - z1) * rho1 / (rho1 + rho2)
        return s, s
    s, t = _two_points(first, second, source, target)
    if not np.isnan(s) and face == THROUGH_SPACE:
        behind, before = angle_about(first, on_edge(second, t)), angle_about(second, on_edge(first, s))
        if not (TOO_NEAR < behind < first[5] - TOO_NEAR and TOO_NEAR < before < second[5] - TOO_NEAR):
            return np.nan, np.nan
    return s, t


@compiled
def _beyond(wedge, before, along, behind):
    """How much longer the way through the nearer end of the edge is than the shortest; −1 if that is on the edge."""
    if 0 <= along <= wedge[4]:
        return -1.0
    z1, rho1 = about(wedge, before)
    z2, rho2 = about(wedge, behind)
    _, by_start, by_end = diffraction_point(z1, rho1, z2, rho2, wedge[4])
    return -min(by_start, by_end)


@compiled
def points_of_diffraction(first, second, twice, face, begin, end, wavelength):
    """The points of diffraction along the edges of a chain; nan if they are too far beyond the ends of the edges."""
    s, t = shortest(first, second, twice, face, begin, end)
    if np.isnan(s):
        return s, t
    if twice:
        p, q = on_edge(first, s), on_edge(second, t)
        beyond = max(_beyond(first, begin, s, q), _beyond(second, p, t, end))
        p, q = on_edge_or_end(first, s), on_edge_or_end(second, t)
        if min(about(second, p)[1], about(first, q)[1]) < CORNER * wavelength:
            return np.nan, np.nan
    else:
        beyond = _beyond(first, begin, s, end)
    if beyond > REACH * wavelength:
        return np.nan, np.nan
    return s, t
