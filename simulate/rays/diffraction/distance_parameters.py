"""The quantities of a chain's way around its edges that the uniform theory needs.

For the whole way these are its length and the spreading of the wave. The amplitude behind the edges is λ/4π times the
spreading.
"""

from __future__ import annotations

from typing import NamedTuple

from simulate.rays.core.ray_tracer import dr, mi
from simulate.rays.diffraction.diffraction_points import (
    Pair,
    Wedge,
    detours,
    hypotenuse,
    point_of_diffraction,
)

APART = 1 / 4
"""Wavelengths. Two points of diffraction that are nearer to each other belong to a corner, which two edges do not
describe. From this distance to twice as far the wave's weight rises from 0 to 1."""


class AroundEdge(NamedTuple):
    """The way around one edge."""

    angle_in: mi.Float64  # φ′, radians
    angle_out: mi.Float64  # φ, radians
    before: mi.Float64  # distance s′ to the edge, metres
    behind: mi.Float64  # distance s from the edge, metres
    sin_beta: mi.Float64  # sine of the angle β₀ between path and edge
    # how much longer the ways through the start and the end of the edge are, from the vertex before the edge to the
    # vertex after it, metres; negative if the point of diffraction lies beyond that end
    by_start: mi.Float64
    by_end: mi.Float64
    # how much longer the way by the edge is than the way of a wave that goes straight or is reflected at a face of
    # the edge, whichever is longest, metres; 0 at a shadow or reflection boundary
    excess: mi.Float64
    length: mi.Float64  # L (``transition_pairs``), metres

    @classmethod
    def of(
        cls,
        wedge: Wedge,
        before: tuple[mi.Float64, mi.Float64],
        behind: tuple[mi.Float64, mi.Float64],
        angle_in: mi.Float64,
        angle_out: mi.Float64,
    ) -> AroundEdge:
        """The way between two points with given z and ρ."""
        (z1, rho1), (z2, rho2) = before, behind
        z = point_of_diffraction(z1, rho1, z2, rho2)
        ahead, after = hypotenuse(rho1, z1 - z), hypotenuse(rho2, z2 - z)
        # The smallest of the cosines belongs to the nearest boundary.
        total = angle_in + angle_out
        cosine = dr.minimum(dr.cos(angle_in - angle_out), dr.cos(total))
        cosine = dr.minimum(cosine, dr.cos(2 * wedge.exterior - total))
        whole = ahead + after
        excess = whole - dr.sqrt(dr.maximum(whole * whole - 2 * rho1 * rho2 * (1 + cosine), 0))
        sine = rho1 / ahead
        ends = detours(z1, rho1, z2, rho2, z, wedge.length)
        return cls(angle_in, angle_out, ahead, after, sine, *ends, excess, ahead * after / whole * sine * sine)


class Around(NamedTuple):
    """The way around all edges of a chain."""

    travelled: mi.Float64  # length of the whole way, metres
    spreading: mi.Float64  # 1/metres
    edges: list[AroundEdge]


def around_one(
    wedge: Wedge,
    begin: tuple[mi.Float64, mi.Float64],
    end: tuple[mi.Float64, mi.Float64],
    angle_in: mi.Float64,
    angle_out: mi.Float64,
) -> Around:
    """The way around one edge, between two images with given z and ρ."""
    edge = AroundEdge.of(wedge, begin, end, angle_in, angle_out)
    whole = edge.before + edge.behind
    return Around(whole, dr.rsqrt(edge.before * edge.behind * whole), [edge])


def around_two(
    first: Wedge,
    second: Wedge,
    points: tuple[mi.Float64, mi.Float64],
    images: tuple[mi.Point3d, mi.Point3d],
    faces: tuple[mi.Float64, mi.Float64],
    along_face: mi.Bool,
    angle_in: mi.Float64,
    angle_out: mi.Float64,
    wavelength: mi.Float64,
) -> Around:
    """The way around two edges, from image to image, with the face of each edge along which it runs, if any."""
    (begin, end), (s, t), pair = images, points, Pair.of(first, second)
    p, q = first.at(s), second.at(t)
    behind_first = dr.select(along_face, faces[0] * first.exterior, first.angle_about(q))
    before_second = dr.select(along_face, faces[1] * second.exterior, second.angle_about(p))
    one = AroundEdge.of(first, first.about(begin), pair.of_second(t), angle_in, behind_first)
    two = AroundEdge.of(second, pair.of_first(s), second.about(end), before_second, angle_out)
    before, apart, behind = one.before, one.behind, two.behind
    whole = before + apart + behind
    weight = dr.clip(apart / (APART * wavelength) - 1, 0, 1)
    # The field on a face consists of the incident and the reflected wave, which are one wave here.
    weight = dr.select(along_face, weight / 2, weight)
    # Behind the first edge the wavefront has the radii s₁₂ across it and s′ + s₁₂ along it.
    twist = _sine_between(first, second, p, q)
    spreading = weight * dr.rsqrt(before * behind * (apart * whole + before * behind * twist * twist))
    # Near a boundary of the second edge (share 1), L of the first edge is as for a wave that goes on to the target, and
    # the second edge gets the first one's wavefront. Near a boundary of the first edge it is the other way round.
    share = one.excess / (one.excess + two.excess + 1e-12)
    length = share * before * (apart + behind) / whole + (1 - share) * _length_between(behind, apart, before, twist)
    other_length = (
        share * _length_between(before, apart, behind, twist) + (1 - share) * (before + apart) * behind / whole
    )
    # At a shadow boundary of one edge, the ends of the other edge act as if it were alone.
    wavenumber = 2 * dr.pi / wavelength
    here = share * dr.exp(-wavenumber * (apart + behind - dr.norm(p - end)))
    there = (1 - share) * dr.exp(-wavenumber * (before + apart - dr.norm(begin - q)))
    one = _partly(one, here, AroundEdge.of(first, first.about(begin), first.about(end), angle_in, behind_first))
    two = _partly(two, there, AroundEdge.of(second, second.about(begin), second.about(end), before_second, angle_out))
    one = one._replace(length=length * one.sin_beta * one.sin_beta)
    two = two._replace(length=other_length * two.sin_beta * two.sin_beta)
    return Around(whole, spreading, [one, two])


def _partly(edge: AroundEdge, share: mi.Float64, alone: AroundEdge) -> AroundEdge:
    """The way around an edge whose ends act in part as if it were alone."""
    names = "by_start", "by_end", "excess"
    own = {name: getattr(edge, name) for name in names}
    return edge._replace(**{name: value + share * (getattr(alone, name) - value) for name, value in own.items()})


def _sine_between(first: Wedge, second: Wedge, p: mi.Point3d, q: mi.Point3d) -> mi.Float64:
    """Sine of the angle between two edges, seen along the way between points on them."""
    way = q - p
    a, b = dr.cross(way, first.direction), dr.cross(way, second.direction)
    squares = dr.squared_norm(a) * dr.squared_norm(b)
    product = dr.dot(a, b)
    return dr.select(squares > 1e-24, dr.sqrt(dr.maximum(1 - product * product / squares, 0)), 0)


def _length_between(before: mi.Float64, apart: mi.Float64, behind: mi.Float64, twist: mi.Float64) -> mi.Float64:
    """L / sin² β₀ at the second of two edges ([kouyoumjian1974], equation 33).

    The wavefront has the radii ρ₁ = s₁₂ and ρ₂ = s′ + s₁₂, and the radius ρ along the second edge.
    """
    whole = before + apart
    along = 1 / ((1 - twist * twist) / whole + twist * twist / apart)
    return behind * (along + behind) * apart * whole / (along * (apart + behind) * (whole + behind))
