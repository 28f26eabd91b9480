"""The points of diffraction of a chain, and what the uniform theory needs to know of the way around an edge.

A chain's antennas, mirrored by its arms, have the images I and I′; between them are one edge or two. All functions take
single numbers and tuples of them, not arrays: numba counts references to arrays at every call.

A wedge here is a tuple: start, direction, normal and tangent of face 0, length, exterior angle (``Edges``).
"""

from __future__ import annotations

import numba
import numpy as np

from simulate.diffraction.corners import REACH
from simulate.diffraction.ends import TOO_NEAR
from simulate.diffraction.links import THROUGH_SPACE

CORNER = 1 / 50
"""Wavelengths; a point of diffraction that is nearer to the other edge's line is at their common corner."""

ROUNDS = 12
"""Steps of Newton's method; five or six suffice."""

CONVERGED = 1e-7
"""Metres; the next step is of the order of its square."""


@numba.njit(cache=True)
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


@numba.njit(cache=True)
def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@numba.njit(cache=True)
def _minus(a, b):
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@numba.njit(cache=True)
def distance(a, b):
    way = _minus(a, b)
    return np.sqrt(_dot(way, way))


@numba.njit(cache=True)
def _cross(a, b):
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@numba.njit(cache=True)
def _length(a, b):
    return np.sqrt(a * a + b * b)


@numba.njit(cache=True)
def _about(wedge, point):
    """Cylindrical coordinates z and ρ of a point about an edge."""
    offset = _minus(point, wedge[0])
    along = _dot(offset, wedge[1])
    return along, np.sqrt(max(_dot(offset, offset) - along * along, 0.0))


@numba.njit(cache=True)
def angle_about(wedge, point):
    """Angle φ of a point about an edge, from face 0 on."""
    offset = _minus(point, wedge[0])
    return np.arctan2(_dot(offset, wedge[2]), _dot(offset, wedge[3])) % (2 * np.pi)


@numba.njit(cache=True)
def on_edge(wedge, along):
    """The point of an edge's line at a distance from its start."""
    start, direction = wedge[0], wedge[1]
    return start[0] + along * direction[0], start[1] + along * direction[1], start[2] + along * direction[2]


@numba.njit(cache=True)
def on_edge_or_end(wedge, along):
    """The point of an edge nearest to one of its line."""
    return on_edge(wedge, min(max(along, 0.0), wedge[4]))


@numba.njit(cache=True)
def _diffraction_point(z1, rho1, z2, rho2, length):
    """z, and how much longer the ways through the edge's start and end are, negative if z lies beyond."""
    z = z1 + (z2 - z1) * rho1 / (rho1 + rho2)
    shortest = _length(rho1 + rho2, z2 - z1)
    by_start = _length(rho1, z1) + _length(rho2, z2) - shortest
    by_end = _length(rho1, z1 - length) + _length(rho2, z2 - length) - shortest
    return z, by_start if z >= 0 else -by_start, by_end if z <= length else -by_end


@numba.njit(cache=True)
def _two_points(first, second, source, target):
    """Where the way from a source by two edges to a target is shortest, along each edge; nan if Newton fails."""
    z1, rho1 = _about(first, source)
    z2, rho2 = _about(second, target)
    between = _minus(second[0], first[0])
    between_d, between_e = _dot(between, first[1]), _dot(between, second[1])
    parallel, square = _dot(first[1], second[1]), _dot(between, between)
    # Begin where Keller's cone is right for the middle of the other edge.
    along, away = _about(first, on_edge(second, second[4] / 2))
    s = z1 + (along - z1) * rho1 / (rho1 + away)
    along, away = _about(second, on_edge(first, s))
    t = z2 + (along - z2) * rho2 / (rho2 + away)
    for _ in range(ROUNDS):
        a, b = _length(rho1, s - z1), _length(rho2, t - z2)
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


@numba.njit(cache=True)
def shortest(first, second, twice, face, source, target):
    """The points of diffraction along the edges of a chain; nan where no wave goes from edge to edge."""
    if not twice:
        z1, rho1 = _about(first, source)
        z2, rho2 = _about(first, target)
        s = z1 + (z2 - z1) * rho1 / (rho1 + rho2)
        return s, s
    s, t = _two_points(first, second, source, target)
    if not np.isnan(s) and face == THROUGH_SPACE:
        behind, before = angle_about(first, on_edge(second, t)), angle_about(second, on_edge(first, s))
        if not (TOO_NEAR < behind < first[5] - TOO_NEAR and TOO_NEAR < before < second[5] - TOO_NEAR):
            return np.nan, np.nan
    return s, t


@numba.njit(cache=True)
def _beyond(wedge, before, along, behind):
    """By how much longer the way by the end is that a point of diffraction lies beyond; −1: it is on the edge."""
    if 0 <= along <= wedge[4]:
        return -1.0
    z1, rho1 = _about(wedge, before)
    z2, rho2 = _about(wedge, behind)
    _, by_start, by_end = _diffraction_point(z1, rho1, z2, rho2, wedge[4])
    return -min(by_start, by_end)


@numba.njit(cache=True)
def points_of_diffraction(first, second, twice, face, begin, end, wavelength):
    """The points of diffraction along the edges of a chain; nan where they are too far beyond the edges' ends."""
    s, t = shortest(first, second, twice, face, begin, end)
    if np.isnan(s):
        return s, t
    if twice:
        p, q = on_edge(first, s), on_edge(second, t)
        beyond = max(_beyond(first, begin, s, q), _beyond(second, p, t, end))
        p, q = on_edge_or_end(first, s), on_edge_or_end(second, t)
        if min(_about(second, p)[1], _about(first, q)[1]) < CORNER * wavelength:
            return np.nan, np.nan
    else:
        beyond = _beyond(first, begin, s, end)
    if beyond > REACH * wavelength:
        return np.nan, np.nan
    return s, t


@numba.njit(cache=True)
def around_edge(wedge, before, behind, angle, other_angle):
    """Distances s′ and s to the edge, sin β₀, the detours by the edge's ends, and the excess."""
    z1, rho1 = _about(wedge, before)
    z2, rho2 = _about(wedge, behind)
    z, by_start, by_end = _diffraction_point(z1, rho1, z2, rho2, wedge[4])
    ahead, after = _length(rho1, z1 - z), _length(rho2, z2 - z)
    # The smallest of the cosines belongs to the nearest boundary.
    total = angle + other_angle
    cosine = min(np.cos(angle - other_angle), np.cos(total), np.cos(2 * wedge[5] - total))
    whole = ahead + after
    excess = whole - np.sqrt(max(whole**2 - 2 * rho1 * rho2 * (1 + cosine), 0.0))
    return ahead, after, rho1 / ahead, by_start, by_end, excess


@numba.njit(cache=True)
def sine_between(first, second, p, q):
    """Sine of the angle between two edges as seen along the way between points on them."""
    way = _minus(q, p)
    a, b = _cross(way, first[1]), _cross(way, second[1])
    squares = _dot(a, a) * _dot(b, b)
    return np.sqrt(max(1 - _dot(a, b) ** 2 / squares, 0.0)) if squares > 1e-24 else 0.0


@numba.njit(cache=True)
def length_between(before, apart, behind, twist):
    """L at the second of two edges, over sin² β₀ (Kouyoumjian and Pathak 1974, equation 33).

    The wavefront has the radii ρ₁ = s₁₂ and ρ₂ = s′ + s₁₂, and ρ along the second edge.
    """
    whole = before + apart
    along = 1 / ((1 - twist**2) / whole + twist**2 / apart)
    return behind * (along + behind) * apart * whole / (along * (apart + behind) * (whole + behind))
