"""The electric field of a wave on its way out of an antenna, through objects, and into another antenna.

At each object the field is multiplied by the transmission coefficients of a slab [itu2023]. A conductor blocks it.
"""

from __future__ import annotations

from simulate.rays.core.ray_tracer import dr, mi, rt_utils
from simulate.rays.core.sionna_scene import Antennas
from simulate.rays.core.surfaces import Surfaces

NEAR = 1e-4
"""Metres from a vertex within which a surface does not block a path, since it is the surface of the vertex."""

Field = tuple[mi.Vector3f, mi.Vector3f]
"""Real and imaginary parts of the electric field, world frame."""


def pattern(antennas: Antennas, towards: mi.Vector3f) -> Field:
    """The field that antennas radiate in some directions, without phase and spreading."""
    # Constants would be part of Dr.Jit's kernels, so a new orientation would compile the kernels again.
    rotation = rt_utils.rotation_matrix(mi.Point3f(*(dr.opaque(mi.Float, float(angle)) for angle in antennas.angles)))
    theta, phi = rt_utils.theta_phi_from_unit_vec(rotation.T @ towards)
    c_theta, c_phi = antennas.pattern(theta, phi)
    return composed(c_theta, rotation @ rt_utils.theta_hat(theta, phi), c_phi, rotation @ rt_utils.phi_hat(phi))


def component(field: Field, axis: mi.Vector3f) -> mi.Complex2f:
    """The field's component along a unit vector."""
    return mi.Complex2f(dr.dot(field[0], axis), dr.dot(field[1], axis))


def composed(first: mi.Complex2f, axis: mi.Vector3f, second: mi.Complex2f, other: mi.Vector3f) -> Field:
    """The field with given components along two unit vectors."""
    return (
        mi.Vector3f(first.real * axis + second.real * other),
        mi.Vector3f(first.imag * axis + second.imag * other),
    )


def turned(field: Field, factor: mi.Complex2f) -> Field:
    """The field times a complex number."""
    real, imaginary = field
    return (
        mi.Vector3f(factor.real * real - factor.imag * imaginary),
        mi.Vector3f(factor.real * imaginary + factor.imag * real),
    )


def across(direction: mi.Vector3f, normal: mi.Vector3f) -> mi.Vector3f:
    """A unit vector perpendicular to both. If they are parallel, any one perpendicular to the direction."""
    found = dr.cross(direction, normal)
    other = dr.cross(direction, dr.select(dr.abs(direction.x) < 0.9, mi.Vector3f(1, 0, 0), mi.Vector3f(0, 1, 0)))
    return dr.normalize(dr.select(dr.squared_norm(found) > 1e-10, found, other))


def slab(field: Field, way_in: mi.Vector3f, way_out: mi.Vector3f, normal: mi.Vector3f, te, tm) -> Field:
    """The field after a slab whose coefficients are TE (across the plane of incidence) and TM (in this plane)."""
    axis = across(way_in, normal)
    return composed(
        te * component(field, axis),
        axis,
        tm * component(field, dr.cross(axis, way_in)),
        dr.cross(axis, way_out),
    )


@dr.syntax
def pass_through(
    surfaces: Surfaces,
    start: mi.Point3f,
    direction: mi.Vector3f,
    length: mi.Float,
    field: Field,
    passes: mi.UInt,
    blocked: mi.Bool,
) -> tuple[Field, mi.UInt, mi.Bool]:
    """The field behind all objects on a straight line, without the phase and the spreading along the line."""
    real, imaginary = field
    passes, blocked = mi.UInt(passes), mi.Bool(blocked)  # copies, since Dr.Jit changes arrays in place
    travelled = mi.Float(NEAR)
    active = ~blocked & (length > 2 * NEAR)
    while active:
        ray = mi.Ray3f(start + travelled * direction, direction)
        ray.maxt = length - NEAR - travelled
        hit = surfaces.scene.ray_intersect_preliminary(ray, active=active)
        active &= hit.is_valid()
        face = surfaces.face(hit, active)
        blocked |= active & (surfaces.conducts(face, active) | (passes == 0))
        active &= ~blocked
        passes -= dr.select(active, 1, 0)
        if active:
            normal = surfaces.normal(face)
            _, _, te, tm = surfaces.coefficients(face, direction)
            real, imaginary = slab((real, imaginary), direction, direction, normal, te, tm)
            travelled += hit.t + NEAR
        active &= travelled < length - NEAR
    return (real, imaginary), passes, blocked
