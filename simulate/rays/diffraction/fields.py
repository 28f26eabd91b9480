"""The field behind an edge of a conductor or of a dielectric sheet."""

from __future__ import annotations

from functools import partial

import numpy as np
from jaxtyping import Complex, Float

from simulate.rays.core.electric_field import Field, component, composed, turned
from simulate.rays.core.path_fields import path_amplitudes
from simulate.rays.core.ray_tracer import dr, mi
from simulate.rays.core.sionna_scene import Antennas
from simulate.rays.core.surfaces import Surfaces
from simulate.rays.diffraction.chain_geometry import PathGeometry
from simulate.rays.diffraction.corners import end_weight
from simulate.rays.diffraction.edges import Edges
from simulate.rays.diffraction.thin_sheet import behind_sheet, currents
from simulate.rays.diffraction.wedge import common_factor, transition_pairs


def behind_edge(
    surfaces: Surfaces,
    edges: Edges,
    geometry: PathGeometry,
    number: int,
    field: Field,
    way_in: mi.Vector3f,
    way_out: mi.Vector3f,
) -> Field:
    """The field behind an edge, without the phase and the spreading on the way."""
    which = geometry.edges[number]
    edge = mi.UInt(which.astype(np.uint32))
    k = surfaces.wavenumber
    n = dr.gather(mi.Float, mi.Float((edges.exterior / np.pi).astype(np.float32)), edge)
    angle_in, angle_out = (mi.Float(angle) for angle in geometry.angles[number])
    length, sin_beta = mi.Float(geometry.length[number]), mi.Float(geometry.sin_beta[number])
    direct, reflected = transition_pairs(angle_out, angle_in, n, length, k)
    # Unit vectors perpendicular to the plane of edge and ray, before and behind the edge.
    along = dr.gather(mi.Vector3f, _vectors(edges.directions), edge)
    phi_in, phi_out = dr.normalize(dr.cross(way_in, along)), dr.normalize(dr.cross(along, way_out))
    found = composed(
        (reflected - direct) * component(field, dr.cross(phi_in, way_in)),
        dr.cross(phi_out, way_out),
        -(direct + reflected) * component(field, phi_in),
        phi_out,
    )
    if edges.sheets[which].any():
        normal = dr.gather(mi.Vector3f, _vectors(edges.normals), edge)
        face = dr.gather(mi.UInt, mi.UInt(edges.faces.astype(np.uint32)), edge)
        driven, sending = (
            currents(way, normal, *surfaces.centred_coefficients(face, dr.abs(dr.dot(way, normal))))
            for way in (way_in, way_out)
        )
        pairs = direct, reflected
        sheet = behind_sheet(field, way_in, way_out, normal, driven, sending, (angle_in, angle_out), pairs, sin_beta)
        # The slab's middle may lie beside the triangle. A wave that is scattered there has another way.
        middle = surfaces.middle(face) * dr.dot(surfaces.normal(face), way_out - way_in)
        sheet = turned(sheet, dr.exp(mi.Complex2f(0, k * middle)))
        is_sheet = dr.gather(mi.Bool, mi.Bool(edges.sheets), edge)
        found = dr.select(is_sheet, sheet[0], found[0]), dr.select(is_sheet, sheet[1], found[1])
    detours, excess = [mi.Float(detour) for detour in geometry.detours[number]], mi.Float(geometry.excess[number])
    weight = end_weight(detours, excess, k) * common_factor(n, sin_beta, k)
    return turned(found, weight)


def _vectors(values: Float[np.ndarray, "paths 3"]) -> mi.Vector3f:
    return mi.Vector3f(np.ascontiguousarray(values.T, dtype=np.float32))


def diffracted_amplitudes(
    surfaces: Surfaces,
    edges: Edges,
    sources: Antennas,
    targets: Antennas,
    geometry: PathGeometry,
    first_edge: int,
) -> Complex[np.ndarray, " paths"]:
    """The amplitude of each path between its source and its target, 0 if it is blocked."""
    at_edges = {
        first_edge + number: partial(behind_edge, surfaces, edges, geometry, number)
        for number in range(len(geometry.edges))
    }
    return path_amplitudes(surfaces, sources, targets, geometry, at_edges)
