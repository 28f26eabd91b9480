"""The points where the shortest way between two antennas' images, by one edge or two, touches the edges."""

from __future__ import annotations

import numpy as np

from simulate.parallel.compiled import compiled
from simulate.rays.diffraction.corners import REACH
from simulate.rays.diffraction.cylindrical import (
    about,
    angle_about,
    diffraction_point,
    dot,
    hypotenuse,
    minus,
    on_edge,
    on_edge_or_end,
)
from simulate.rays.diffraction.ends import TOO_NEAR
from simulate.rays.diffraction.links import THROUGH_SPACE

CORNER = 1 / 50
"""Wavelengths. A point of diffraction that is nearer to the line of the other edge is at their common corner."""

ROUNDS = 12
"""Most steps of Newton's method. Five or six suffice."""

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
