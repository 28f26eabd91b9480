"""The electric field of a wave along a path, and the amplitude that the path so contributes to a response.

At every reflection, and where the path passes through an object, the field is multiplied by the coefficients of a slab
[itu2023]. A path that a conductor blocks contributes nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from simulate.rays.core.propagation import MOST_PASSES
from simulate.rays.core.ray_scene import NEAR
from simulate.rays.core.ray_tracer import dr, mi, rt_utils
from simulate.rays.core.sionna_scene import Antennas
from simulate.rays.core.surfaces import Surfaces

Amplitude = tuple[mi.Float64, mi.Float64]
"""Real and imaginary part of the amplitude of each path, not computed yet."""

Field = tuple[mi.Vector3f, mi.Vector3f]  # Real and imaginary parts of the electric field, world frame


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

    def behind(before: Field, face: mi.UInt) -> Field:
        _, _, te, tm = surfaces.coefficients(face, direction)
        return slab(before, direction, direction, surfaces.normal(face), te, tm)

    return _along(surfaces, start, direction, length, field, passes, blocked, behind)


@dr.syntax
def _along(surfaces, start, direction, length, state, passes, blocked, behind):
    """What is left of a field, or of its strength, behind all objects on a line; ``behind`` takes it through one."""
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
            state = behind(state, face)
            travelled += hit.t + NEAR
        active &= travelled < length - NEAR
    return state, passes, blocked


AtEdge = Callable[[Surfaces, Field, mi.Vector3f, mi.Vector3f], Field]
"""The field behind an edge, from the field before it and the directions before and behind it."""


@dataclass(frozen=True)
class Ways:
    """The ways of paths with equal numbers of interactions."""

    sources: mi.UInt  # index of each path's source
    targets: mi.UInt  # index of each path's target
    vertices: list[mi.Point3f]  # places of the interactions, in the order from source to target, metres
    faces: list[mi.UInt]  # number of each interaction's triangle, counted through the scene's objects
    # length of each path, metres; in double precision, since a path is many wavelengths long
    travelled: mi.Float64
    # what is left of the amplitude of a wave behind its antenna and edges, per metre: 1 / length for a path without
    # edges
    spreading: mi.Float64
    at_edges: Mapping[int, AtEdge]  # what happens at each edge, by its number among the interactions


SHORT = 0.05
"""Metres. In single precision a vertex is rounded by up to 0.2 µm, which turns a short leg. In a corner, a leg between
two reflections may be shorter than that. So the direction of a shorter leg behind a reflection is mirrored from the leg
before."""


def path_amplitudes(surfaces: Surfaces, sources: Antennas, targets: Antennas, ways: Ways) -> Amplitude:
    """The amplitude of each path between its source and its target, 0 if it is blocked."""
    sent, received, blocked = _fields(surfaces, sources, targets, ways, empty=False)
    real = dr.dot(received[0], sent[0]) + dr.dot(received[1], sent[1])
    imaginary = dr.dot(received[0], sent[1]) - dr.dot(received[1], sent[0])
    free_space = dr.opaque(mi.Float64, surfaces.wavelength / (4 * np.pi))
    spreading = dr.select(blocked, 0, free_space * ways.spreading)
    return spreading * real, spreading * imaginary


def in_empty_space(surfaces: Surfaces, sources: Antennas, targets: Antennas, ways: Ways) -> mi.Float:
    """How large the amplitude of each path can be if nothing is in its way, in any polarisation."""
    sent, received, _ = _fields(surfaces, sources, targets, ways, empty=True)
    power = _squared(sent) * _squared(received)
    return dr.sqrt(power) * mi.Float(dr.abs(ways.spreading)) * dr.opaque(mi.Float, surfaces.wavelength / (4 * np.pi))


def _squared(field: Field) -> mi.Float:
    return dr.squared_norm(field[0]) + dr.squared_norm(field[1])


def _fields(
    surfaces: Surfaces, sources: Antennas, targets: Antennas, ways: Ways, empty: bool
) -> tuple[Field, Field, mi.Bool]:
    """The field at the end of each path, without phase and spreading, that which its target would send, and blocked."""
    interactions = len(ways.vertices)
    passes = mi.UInt(MOST_PASSES if surfaces.refraction else 0)
    points = [dr.gather(mi.Point3f, sources.points, ways.sources), *ways.vertices]
    points += [dr.gather(mi.Point3f, targets.points, ways.targets)]
    steps = [mi.Vector3f(after - before) for before, after in pairwise(points)]
    lengths = [mi.Float(dr.norm(step)) for step in steps]
    directions = [mi.Vector3f(step / length) for step, length in zip(steps, lengths, strict=True)]
    for number in range(interactions):
        if number not in ways.at_edges:
            mirrored = _mirrored(directions[number], surfaces.normal(ways.faces[number]))
            directions[number + 1] = dr.select(lengths[number + 1] < SHORT, mirrored, directions[number + 1])

    field, blocked = pattern(sources, directions[0]), mi.Bool(False)
    for number, way in enumerate(directions):
        if not empty:
            leg = points[number], way, lengths[number]
            field, passes, blocked = pass_through(surfaces, *leg, field, passes, blocked)
        if number in ways.at_edges:
            field = ways.at_edges[number](surfaces, field, way, directions[number + 1])
        elif number < interactions:
            face = ways.faces[number]
            te, tm, _, _ = surfaces.coefficients(face, way)
            smooth = dr.sqrt(1 - surfaces.scattering(face) ** 2)  # the rest is scattered
            field = slab(field, way, directions[number + 1], surfaces.normal(face), smooth * te, smooth * tm)
    return field, pattern(targets, -directions[-1]), blocked


def solved(surfaces: Sequence[Surfaces], sources: Antennas, targets: Antennas, ways: Ways) -> list[Amplitude]:
    """The amplitudes of paths with each of some sets of materials."""
    if len(surfaces) > 1:
        dr.eval(ways)
    return [path_amplitudes(each, sources, targets, ways) for each in surfaces]


def surviving(surfaces: Surfaces, points: Sequence[mi.Point3f], faces: Sequence[mi.UInt]) -> mi.Float:
    """The share of the amplitude that surfaces leave on ways over reflections, at most; 0 if a conductor blocks."""
    strength, blocked = mi.Float(1), mi.Bool(False)
    passes = mi.UInt(MOST_PASSES if surfaces.refraction else 0)
    for number, (start, end) in enumerate(pairwise(points)):
        length = mi.Float(dr.norm(end - start))
        direction = mi.Vector3f((end - start) / length)

        def behind(before: mi.Float, face: mi.UInt, way: mi.Vector3f = direction) -> mi.Float:
            _, _, te, tm = surfaces.coefficients(face, way)
            return before * dr.maximum(dr.abs(te), dr.abs(tm))

        strength, passes, blocked = _along(surfaces, start, direction, length, strength, passes, blocked, behind)
        if number < len(faces):
            te, tm, _, _ = surfaces.coefficients(faces[number], direction)
            strength = strength * dr.maximum(dr.abs(te), dr.abs(tm))
    return dr.select(blocked, 0, strength)


def _mirrored(direction: mi.Vector3f, normal: mi.Vector3f) -> mi.Vector3f:
    """The direction behind a reflection."""
    return dr.normalize(direction - 2 * dr.dot(direction, normal) * normal)
