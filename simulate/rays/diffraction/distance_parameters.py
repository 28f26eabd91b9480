"""The quantities of a chain's way around its edges that the uniform theory needs.

For every edge these are the angles φ′ and φ, the sine of β₀, the detours through the start and the end of the edge, the
excess, and L. ``PathGeometry`` explains them. For the whole way they are its length and the spreading of the wave. The
amplitude behind the edges is λ/4π times the spreading.
"""

from __future__ import annotations

import numpy as np

from simulate.parallel.compiled import compiled
from simulate.rays.diffraction.diffraction_chains import THROUGH_SPACE
from simulate.rays.diffraction.diffraction_points import (
    about,
    angle_about,
    cross,
    diffraction_point,
    distance,
    dot,
    hypotenuse,
    minus,
    on_edge,
)

APART = 1 / 4
"""Wavelengths. Two points of diffraction that are nearer to each other belong to a corner, which two edges do not
describe. From this distance to twice as far the wave's weight rises from 0 to 1."""


@compiled
def around_one(wedge, begin, end, phi_begin, phi_end):
    """Length of the way by one edge, its spreading, and the edge's quantities, twice as in ``around_two``."""
    before, behind, sine, by_start, by_end, excess = _around_edge(wedge, begin, end, phi_begin, phi_end)
    whole = before + behind
    figures = phi_begin, phi_end, sine, by_start, by_end, excess, before * behind / whole * sine**2
    return whole, 1 / np.sqrt(before * behind * whole), (figures, figures)


@compiled
def around_two(first, second, faces, s, t, begin, end, phi_begin, phi_end, wavelength):
    """Length of the way by two edges, its spreading, and the quantities of each edge."""
    p, q = on_edge(first, s), on_edge(second, t)
    if faces[0] == THROUGH_SPACE:
        phi_behind, phi_before = angle_about(first, q), angle_about(second, p)
    else:
        phi_behind, phi_before = faces[0] * first[5], faces[1] * second[5]
    before, apart, sine, by_start, by_end, excess = _around_edge(first, begin, q, phi_begin, phi_behind)
    _, behind, other_sine, other_by_start, other_by_end, other_excess = _around_edge(
        second, p, end, phi_before, phi_end
    )
    whole = before + apart + behind
    weight = min(max(apart / (APART * wavelength) - 1, 0.0), 1.0)
    if faces[0] != THROUGH_SPACE:
        weight /= 2  # the field on a face consists of the incident and the reflected wave, which are one wave here
    # Behind the first edge the wavefront has the radii s₁₂ across it and s′ + s₁₂ along it.
    twist = _sine_between(first, second, p, q)
    spreading = weight / np.sqrt(before * behind * (apart * whole + before * behind * twist**2))
    # Near a boundary of the second edge (share 1), L of the first edge is as for a wave that goes on to the target, and
    # the second edge gets the first one's wavefront. Near a boundary of the first edge it is the other way round.
    share = excess / (excess + other_excess + 1e-12)
    length = share * before * (apart + behind) / whole + (1 - share) * _length_between(behind, apart, before, twist)
    other_length = (
        share * _length_between(before, apart, behind, twist) + (1 - share) * (before + apart) * behind / whole
    )
    # At a shadow boundary of one edge, the ends of the other edge act as if it were alone.
    wavenumber = 2 * np.pi / wavelength
    here = share * np.exp(-wavenumber * (apart + behind - distance(p, end)))
    there = (1 - share) * np.exp(-wavenumber * (before + apart - distance(begin, q)))
    _, _, _, start_alone, end_alone, alone = _around_edge(first, begin, end, phi_begin, phi_behind)
    by_start += here * (start_alone - by_start)
    by_end += here * (end_alone - by_end)
    excess += here * (alone - excess)
    _, _, _, start_alone, end_alone, alone = _around_edge(second, begin, end, phi_before, phi_end)
    other_by_start += there * (start_alone - other_by_start)
    other_by_end += there * (end_alone - other_by_end)
    other_excess += there * (alone - other_excess)
    return (
        whole,
        spreading,
        (
            (phi_begin, phi_behind, sine, by_start, by_end, excess, length * sine**2),
            (phi_before, phi_end, other_sine, other_by_start, other_by_end, other_excess, other_length * other_sine**2),
        ),
    )


@compiled
def _around_edge(wedge, before, behind, angle, other_angle):
    """Distances s′ and s to the edge, sin β₀, the detours by the start and the end of the edge, and the excess."""
    z1, rho1 = about(wedge, before)
    z2, rho2 = about(wedge, behind)
    z, by_start, by_end = diffraction_point(z1, rho1, z2, rho2, wedge[4])
    ahead, after = hypotenuse(rho1, z1 - z), hypotenuse(rho2, z2 - z)
    # The smallest of the cosines belongs to the nearest boundary.
    total = angle + other_angle
    cosine = min(np.cos(angle - other_angle), np.cos(total), np.cos(2 * wedge[5] - total))
    whole = ahead + after
    excess = whole - np.sqrt(max(whole**2 - 2 * rho1 * rho2 * (1 + cosine), 0.0))
    return ahead, after, rho1 / ahead, by_start, by_end, excess


@compiled
def _sine_between(first, second, p, q):
    """Sine of the angle between two edges, seen along the way between points on them."""
    way = minus(q, p)
    a, b = cross(way, first[1]), cross(way, second[1])
    squares = dot(a, a) * dot(b, b)
    return np.sqrt(max(1 - dot(a, b) ** 2 / squares, 0.0)) if squares > 1e-24 else 0.0


@compiled
def _length_between(before, apart, behind, twist):
    """L / sin² β₀ at the second of two edges ([kouyoumjian1974], equation 33).

    The wavefront has the radii ρ₁ = s₁₂ and ρ₂ = s′ + s₁₂, and the radius ρ along the second edge.
    """
    whole = before + apart
    along = 1 / ((1 - twist**2) / whole + twist**2 / apart)
    return behind * (along + behind) * apart * whole / (along * (apart + behind) * (whole + behind))
