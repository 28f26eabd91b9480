"""The response that a path with diffractions contributes: the electric field, followed from the source on.

At every reflection and wherever the path passes through an object the field is multiplied by the coefficients of a slab
(ITU-R P.2040), at the edge by those of the wedge. A path that meets a conductor on its way contributes nothing.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from jaxtyping import Complex
from sionna.rt.utils import (
    itu_coefficients_single_layer_slab,
    phi_hat,
    rotation_matrix,
    theta_hat,
    theta_phi_from_unit_vec,
)

from simulate.diffraction.corners import end_weight
from simulate.diffraction.edges import Edges
from simulate.diffraction.geometry import Courses
from simulate.diffraction.wedge import wedge_coefficients
from simulate.permittivity import conducting_objects, relative_permittivity
from simulate.propagation import Propagation
from simulate.ray_scene import RayScene
from simulate.ray_tracer import dr, mi
from simulate.sionna_scene import Antennas

NEAR = 1e-4
"""Metres from a vertex within which a surface does not block a path: it is the vertex's own."""

Field = tuple[mi.Vector3f, mi.Vector3f]
"""Real and imaginary part of the electric field, world frame."""


class Surfaces:
    """What the triangles of a scene are made of, on the ray tracer's device.

    Args:
        ray_scene: the scene.
    """

    def __init__(self, ray_scene: RayScene):
        scene = ray_scene.description
        materials = [scene.materials[item.material] for item in scene.objects]
        permittivity = np.array([relative_permittivity(material, scene.frequency) for material in materials])
        self.wavelength = scene.wavelength
        self.scene = ray_scene.sionna.mi_scene
        self._permittivity = mi.Float(permittivity.real), mi.Float(permittivity.imag)
        self._thickness = mi.Float([scene.thickness(item) for item in scene.objects])
        self._conducts = mi.Bool(conducting_objects(scene))
        normals = np.concatenate([item.mesh.face_normals for item in scene.objects])
        self._normals = [mi.Float(axis) for axis in normals.T]
        self._object = mi.UInt(ray_scene.object_of_face)
        self._first_face = mi.UInt(ray_scene.planes.first_face)

    def face(self, hit: mi.PreliminaryIntersection3f, active: mi.Bool) -> mi.UInt:
        """Number of the triangle that a ray has hit."""
        shape = dr.reinterpret_array(mi.UInt, hit.shape)
        return dr.gather(mi.UInt, self._first_face, shape, active) + hit.prim_index

    def normal(self, face: mi.UInt, active: mi.Bool | bool = True) -> mi.Vector3f:
        """Unit normal of a triangle."""
        return mi.Vector3f(*(dr.gather(mi.Float, axis, face, active) for axis in self._normals))

    def conducts(self, face: mi.UInt, active: mi.Bool | bool = True) -> mi.Bool:
        """Whether a triangle is of a conductor."""
        return dr.gather(mi.Bool, self._conducts, dr.gather(mi.UInt, self._object, face, active), active)

    def coefficients(
        self, face: mi.UInt, cosine: mi.Float, active: mi.Bool | bool = True
    ) -> tuple[mi.Complex2f, mi.Complex2f, mi.Complex2f, mi.Complex2f]:
        """Reflection TE and TM, transmission TE and TM, at the cosine of an angle of incidence."""
        item = dr.gather(mi.UInt, self._object, face, active)
        permittivity = mi.Complex2f(*(dr.gather(mi.Float, part, item, active) for part in self._permittivity))
        thickness = dr.gather(mi.Float, self._thickness, item, active)
        return itu_coefficients_single_layer_slab(cosine, permittivity, thickness, self.wavelength)


def _component(field: Field, axis: mi.Vector3f) -> mi.Complex2f:
    return mi.Complex2f(dr.dot(field[0], axis), dr.dot(field[1], axis))


def _composed(first: mi.Complex2f, axis: mi.Vector3f, second: mi.Complex2f, other: mi.Vector3f) -> Field:
    return (
        mi.Vector3f(first.real * axis + second.real * other),
        mi.Vector3f(first.imag * axis + second.imag * other),
    )


def _across(direction: mi.Vector3f, normal: mi.Vector3f) -> mi.Vector3f:
    """A unit vector perpendicular to both, or any that is perpendicular to the direction if they are parallel."""
    found = dr.cross(direction, normal)
    other = dr.cross(direction, dr.select(dr.abs(direction.x) < 0.9, mi.Vector3f(1, 0, 0), mi.Vector3f(0, 1, 0)))
    return dr.normalize(dr.select(dr.squared_norm(found) > 1e-10, found, other))


def _slab(field: Field, way_in: mi.Vector3f, way_out: mi.Vector3f, normal: mi.Vector3f, te, tm) -> Field:
    """The field after a slab with the coefficients for the electric field across (TE) and in the plane of incidence."""
    across = _across(way_in, normal)
    return _composed(
        te * _component(field, across),
        across,
        tm * _component(field, dr.cross(across, way_in)),
        dr.cross(across, way_out),
    )


@dr.syntax
def _passed(
    surfaces: Surfaces,
    start: mi.Point3f,
    direction: mi.Vector3f,
    length: mi.Float,
    field: Field,
    passes: mi.UInt,
    blocked: mi.Bool,
) -> tuple[Field, mi.UInt, mi.Bool]:
    """The field behind all objects on a straight line, how many more may be passed, and whether the path is blocked."""
    real, imaginary = field
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
            _, _, te, tm = surfaces.coefficients(face, dr.abs(dr.dot(direction, normal)))
            real, imaginary = _slab((real, imaginary), direction, direction, normal, te, tm)
            travelled += hit.t + NEAR
        active &= travelled < length - NEAR
    return (real, imaginary), passes, blocked


def _diffracted(
    field: Field,
    edges: Edges,
    courses: Courses,
    number: int,
    way_in: mi.Vector3f,
    way_out: mi.Vector3f,
    wavelength: float,
) -> Field:
    """The field behind an edge, without the phase and the spreading on the way.

    Args:
        field: before the edge.
        edges: the scene's edges.
        courses: the ways of the paths.
        number: which of the paths' diffractions.
        way_in: direction of the wave before the edge.
        way_out: behind it.
        wavelength: metres.
    """
    edge = mi.UInt(courses.edges[number])
    along = mi.Vector3f(*(dr.gather(mi.Float, mi.Float(axis.astype(np.float32)), edge) for axis in edges.directions.T))
    n = dr.gather(mi.Float, mi.Float((edges.exterior / np.pi).astype(np.float32)), edge)
    angle_in, angle_out = (mi.Float(angle) for angle in courses.angles[number])
    length, sin_beta = mi.Float(courses.length[number]), mi.Float(courses.sin_beta[number])
    soft, hard = wedge_coefficients(angle_out, angle_in, n, length, sin_beta, 2 * np.pi / wavelength)
    detours, excess = [mi.Float(detour) for detour in courses.detours[number]], mi.Float(courses.excess[number])
    weight = end_weight(detours, excess, wavelength)
    # Unit vectors across the planes of edge and ray, before and behind.
    phi_in, phi_out = dr.normalize(dr.cross(way_in, along)), dr.normalize(dr.cross(along, way_out))
    return _composed(
        -weight * soft * _component(field, dr.cross(phi_in, way_in)),
        dr.cross(phi_out, way_out),
        -weight * hard * _component(field, phi_in),
        phi_out,
    )


def _pattern(antennas: Antennas, towards: mi.Vector3f) -> Field:
    """The antennas' field pattern in directions of the world frame."""
    rotation = rotation_matrix(mi.Point3f(*(float(angle) for angle in antennas.angles)))
    theta, phi = theta_phi_from_unit_vec(rotation.T @ towards)
    c_theta, c_phi = antennas.pattern(theta, phi)
    return _composed(c_theta, rotation @ theta_hat(theta, phi), c_phi, rotation @ phi_hat(phi))


def path_responses(
    surfaces: Surfaces,
    edges: Edges,
    sources: Antennas,
    targets: Antennas,
    courses: Courses,
    first_edge: int,
    propagation: Propagation,
) -> Complex[np.ndarray, " paths"]:
    """What each path contributes to the response of its target to its source, 0 if it is blocked.

    Args:
        surfaces: of the scene.
        edges: the scene's edges.
        sources: the antennas that the paths begin at.
        targets: the antennas that they end at.
        courses: the ways of the paths.
        first_edge: which of the interactions is the first diffraction.
        propagation: whether, and how often, a path may pass through an object.

    Returns:
        a e^{-j2πfτ} as in ``simulate.paths``, complex128.
    """
    interactions = len(courses.vertices)
    passes = mi.UInt(propagation.max_depth - interactions if propagation.refraction else 0)
    points = [dr.gather(mi.Point3f, sources.points, mi.UInt(courses.sources))]
    points += [mi.Point3f(*(mi.Float(axis) for axis in vertex)) for vertex in courses.vertices]
    points += [dr.gather(mi.Point3f, targets.points, mi.UInt(courses.targets))]
    steps = [mi.Vector3f(after - before) for before, after in pairwise(points)]
    lengths = [dr.norm(step) for step in steps]
    ways = [step / length for step, length in zip(steps, lengths, strict=True)]

    field, blocked = _pattern(sources, ways[0]), mi.Bool(False)
    for number in range(interactions + 1):
        way = ways[number]
        field, passes, blocked = _passed(surfaces, points[number], way, lengths[number], field, passes, blocked)
        diffraction = number - first_edge
        if 0 <= diffraction < len(courses.edges):
            field = _diffracted(field, edges, courses, diffraction, way, ways[number + 1], surfaces.wavelength)
        elif number < interactions:
            face = mi.UInt(courses.faces[number])
            normal = surfaces.normal(face)
            te, tm, _, _ = surfaces.coefficients(face, dr.abs(dr.dot(way, normal)))
            field = _slab(field, way, ways[number + 1], normal, te, tm)
    received = _pattern(targets, -ways[-1])
    real = dr.dot(received[0], field[0]) + dr.dot(received[1], field[1])
    imaginary = dr.dot(received[0], field[1]) - dr.dot(received[1], field[0])
    amplitude = dr.select(blocked, mi.Complex2f(0), mi.Complex2f(real, imaginary))
    dr.eval(amplitude)
    return (amplitude.real.numpy() + 1j * amplitude.imag.numpy()) * courses.propagation
