"""Where the shortest way between two antennas' images, by one edge or two, touches the edges.

Points are in the cylindrical coordinates (ρ, φ, z) of an edge: z from its start along it, φ from face 0 on. All numbers
are arrays of the ray tracer, with a lane for each way.
"""

from __future__ import annotations

from typing import NamedTuple

from simulate.rays.core.image_method import on_device
from simulate.rays.core.ray_tracer import dr, mi
from simulate.rays.diffraction.edges import Edges

TOO_NEAR = 1e-4
"""Metres and radians. The wave of an antenna that is nearer to an edge, or to the plane of its face, is not diffracted
there."""

REACH = 0.5  # Wavelengths. Ends with a longer detour have no effect.

CORNER = 1 / 50
"""Wavelengths. A point of diffraction that is nearer to the line of the other edge is at their common corner."""

ROUNDS = 12  # Most steps of Newton's method. Five or six suffice.

CONVERGED = 1e-7
"""Metres. Newton's method ends at a shorter step, since the next step is of the order of its square."""


class Wedge(NamedTuple):
    """An edge, as ``Edges`` has it."""

    start: mi.Point3d
    direction: mi.Point3d
    normal: mi.Point3d
    tangent: mi.Point3d
    length: mi.Float64
    exterior: mi.Float64
    face: mi.UInt
    sheet: mi.Bool

    @classmethod
    def of(cls, edges: Edges) -> Wedge:
        """All edges."""
        vectors = (on_device(each) for each in (edges.starts, edges.directions, edges.normals, edges.tangents))
        numbers = mi.Float64(edges.lengths), mi.Float64(edges.exterior), mi.UInt(edges.faces), mi.Bool(edges.sheets)
        return cls(*vectors, *numbers)

    def gathered(self, edge: mi.UInt) -> Wedge:
        """The edge of each lane."""
        return Wedge(*(dr.gather(type(each), each, edge) for each in self))

    def about(self, point: mi.Point3d) -> tuple[mi.Float64, mi.Float64]:
        """Cylindrical coordinates z and ρ of a point about the edge."""
        offset = point - self.start
        along = dr.dot(offset, self.direction)
        return along, dr.sqrt(dr.maximum(dr.squared_norm(offset) - along * along, 0))

    def angle_about(self, point: mi.Point3d) -> mi.Float64:
        """Angle φ of a point about the edge, from face 0 on."""
        offset = point - self.start
        angle = dr.atan2(dr.dot(offset, self.normal), dr.dot(offset, self.tangent))
        return dr.select(angle < 0, angle + 2 * dr.pi, angle)

    def at(self, along: mi.Float64) -> mi.Point3d:
        """The point of the edge's line at a distance from its start."""
        return mi.Point3d(self.start + along * self.direction)

    def nearest(self, along: mi.Float64) -> mi.Point3d:
        """The point of the edge that is nearest to a point of its line."""
        return self.at(dr.clip(along, 0, self.length))


def hypotenuse(a: mi.Float64, b: mi.Float64) -> mi.Float64:
    """√(a² + b²)."""
    return dr.sqrt(a * a + b * b)


def point_of_diffraction(z1: mi.Float64, rho1: mi.Float64, z2: mi.Float64, rho2: mi.Float64) -> mi.Float64:
    """The point z along an edge where the angles to the edge are equal."""
    return z1 + (z2 - z1) * rho1 / (rho1 + rho2)


def detours(
    z1: mi.Float64, rho1: mi.Float64, z2: mi.Float64, rho2: mi.Float64, z: mi.Float64, length: mi.Float64
) -> tuple[mi.Float64, mi.Float64]:
    """How much longer the ways through the start and the end of the edge are; negative if z lies beyond."""
    shortest = hypotenuse(rho1 + rho2, z2 - z1)
    by_start = hypotenuse(rho1, z1) + hypotenuse(rho2, z2) - shortest
    by_end = hypotenuse(rho1, z1 - length) + hypotenuse(rho2, z2 - length) - shortest
    return dr.select(z >= 0, by_start, -by_start), dr.select(z <= length, by_end, -by_end)


class Pair(NamedTuple):
    """How two edges lie to each other: b·d, b·e, d·e, b·b with their directions d, e and b between their starts."""

    between_d: mi.Float64
    between_e: mi.Float64
    parallel: mi.Float64
    square: mi.Float64

    @classmethod
    def of(cls, first: Wedge, second: Wedge) -> Pair:
        """The pair of two edges."""
        between = second.start - first.start
        d, e = first.direction, second.direction
        return cls(dr.dot(between, d), dr.dot(between, e), dr.dot(d, e), dr.squared_norm(between))

    def of_second(self, t: mi.Float64) -> tuple[mi.Float64, mi.Float64]:
        """Cylindrical coordinates z and ρ about the first edge of a point of the second one."""
        along = self.between_d + t * self.parallel
        return along, dr.sqrt(dr.maximum(self.square + t * t + 2 * t * self.between_e - along * along, 0))

    def of_first(self, s: mi.Float64) -> tuple[mi.Float64, mi.Float64]:
        """Cylindrical coordinates z and ρ about the second edge of a point of the first one."""
        along = s * self.parallel - self.between_e
        return along, dr.sqrt(dr.maximum(self.square + s * s - 2 * s * self.between_d - along * along, 0))


@dr.syntax
def two_points(
    pair: Pair,
    length: mi.Float64,
    z1: mi.Float64,
    rho1: mi.Float64,
    z2: mi.Float64,
    rho2: mi.Float64,
    active: mi.Bool,
) -> tuple[mi.Float64, mi.Float64, mi.Bool]:
    """The points along two edges for which the way from source to target is shortest, and whether they were found."""
    # Begin where Keller's cone holds for the middle of the other edge.
    s = point_of_diffraction(z1, rho1, *pair.of_second(length / 2))
    t = point_of_diffraction(z2, rho2, *pair.of_first(s))
    rounds, found, running = mi.UInt(0), mi.Bool(False), mi.Bool(active)
    while running:
        a, b = hypotenuse(rho1, s - z1), hypotenuse(rho2, t - z2)
        square = pair.square + s * s + t * t - 2 * s * t * pair.parallel - 2 * s * pair.between_d
        c = dr.sqrt(dr.maximum(square + 2 * t * pair.between_e, 1e-12))
        cs, ct = (s - t * pair.parallel - pair.between_d) / c, (t - s * pair.parallel + pair.between_e) / c
        slope_s, slope_t = (s - z1) / a + cs, (t - z2) / b + ct
        ss = rho1 * rho1 / (a * a * a) + (1 - cs * cs) / c
        tt = rho2 * rho2 / (b * b * b) + (1 - ct * ct) / c
        st = -(pair.parallel + cs * ct) / c
        determinant = ss * tt - st * st
        running &= determinant > 0
        step_s, step_t = (tt * slope_s - st * slope_t) / determinant, (ss * slope_t - st * slope_s) / determinant
        s = dr.select(running, s - dr.clip(step_s, -1, 1), s)
        t = dr.select(running, t - dr.clip(step_t, -1, 1), t)
        found |= running & (dr.abs(step_s) + dr.abs(step_t) < CONVERGED)
        rounds += 1
        running &= ~found & (rounds < ROUNDS)
    return s, t, found
