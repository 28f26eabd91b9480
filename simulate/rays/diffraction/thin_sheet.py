"""Diffraction at the edge of a dielectric sheet: a half-plane that reflects waves and lets them pass.

A thin sheet scatters by the currents in it. A wave with the angle of incidence θ drives four kinds of currents. They
send different waves to the two sides, so their amplitudes follow from the coefficients R of reflection and T of
transmission:

    along the sheet, E across the plane of incidence (TE)    a² = (1 − T − R)/2 · cos θ,
    along it, in the plane of incidence (TM)                 b² = (1 − T + R)/2 / cos θ,
    across it (TM)                                           c² = (1 − T − R)/2 · cos θ / sin² θ,
    loops of current, which a magnetic current stands for    d² = (1 − T + R)/2 / cos θ    (TE).

A piece of a weakly scattering sheet scatters a wave in proportion to a a′ (likewise for b, c, d) times the product of
both waves' unit vectors along the current. Here a belongs to the incident and a′ to the outgoing wave. For a thin sheet
this is the Born approximation (a² = jkt(ε − 1)/2). In the directions of reflection and transmission it is right for any
sheet. Summed over the half-plane, with the angles φ′ and φ about its edge, it gives

    D = −e^{−jπ/4} / (2√(2πk) sin² β₀) · N / (2 cos((φ − φ′)/2) cos((φ + φ′)/2)),    N the negative sum of the four.

With c∓ = cos((φ ∓ φ′)/2) and C = c₊² + c₋², N/(c₋c₊) = (N c₊/C)/c₋ + (N c₋/C)/c₊. The first term is singular at the
shadow boundary, the second at the reflection boundary. Each is multiplied by the transition function of the uniform
theory (wedge.py). At these boundaries the sum then makes up for the jump of T − 1 or R in geometric optics.
"""

from __future__ import annotations

from typing import NamedTuple

from simulate.rays.core.electric_field import Field, across, component, composed
from simulate.rays.core.ray_tracer import dr, mi

GRAZING = 1e-3
"""Smallest cosine of an angle of incidence."""


class Currents(NamedTuple):
    """The currents that a wave drives, or that send a wave: a, b, c, d, and the unit vectors along the currents."""

    a: mi.Complex2f
    b: mi.Complex2f
    c: mi.Complex2f
    d: mi.Complex2f
    across: mi.Vector3f
    along: mi.Vector3f


def currents(way: mi.Vector3f, normal: mi.Vector3f, r_te, r_tm, t_te, t_tm) -> Currents:
    """The currents of a plane wave."""
    cosine = dr.maximum(dr.abs(dr.dot(way, normal)), GRAZING)
    sine_squared = dr.maximum(1 - cosine**2, GRAZING)
    axis = across(way, normal)
    return Currents(
        a=dr.sqrt((1 - t_te - r_te) / 2 * cosine),
        b=dr.sqrt((1 - t_tm + r_tm) / 2 / cosine),
        c=dr.sqrt((1 - t_tm - r_tm) / 2 * cosine / sine_squared),
        d=dr.sqrt((1 - t_te + r_te) / 2 / cosine),
        across=axis,
        along=dr.cross(normal, axis),
    )


def behind_sheet(
    field: Field,
    way_in: mi.Vector3f,
    way_out: mi.Vector3f,
    normal: mi.Vector3f,
    driven: Currents,
    sending: Currents,
    angles: tuple[mi.Float, mi.Float],
    pairs: tuple[mi.Complex2f, mi.Complex2f],
    sin_beta: mi.Float,
) -> Field:
    """The field diffracted at the edge of a sheet, over the common factor of wedge.py, without phase and spreading."""
    te_in = component(field, driven.across)
    first, second = driven.a * te_in, driven.b * component(field, driven.along)

    def tangential(axis: mi.Vector3f) -> mi.Complex2f:
        return dr.dot(axis, driven.across) * first + dr.dot(axis, driven.along) * second

    loops = dr.dot(way_in, normal) * dr.dot(way_out, normal) * dr.dot(sending.across, driven.across)
    tm_out = dr.cross(sending.across, way_out)
    te = sending.a * tangential(sending.across) + sending.d * driven.d * loops * te_in
    tm = sending.b * dr.dot(tm_out, sending.along) * tangential(sending.along)
    tm += sending.c * driven.c * dr.dot(tm_out, normal) * component(field, normal)
    angle_in, angle_out = angles
    plus, minus = dr.cos((angle_out + angle_in) / 2), dr.cos((angle_out - angle_in) / 2)
    shape = -(plus * pairs[0] + minus * pairs[1]) / (dr.maximum(plus**2 + minus**2, GRAZING**2) * sin_beta)
    return composed(shape * te, sending.across, shape * tm, tm_out)
