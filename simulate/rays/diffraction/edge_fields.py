"""The field behind an edge of a conductor or of a dielectric sheet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from simulate.rays.core.electric_field import Field, across, component, composed, turned
from simulate.rays.core.ray_tracer import dr, mi, rt_utils
from simulate.rays.core.surfaces import Surfaces
from simulate.rays.diffraction.diffraction_points import REACH, Wedge
from simulate.rays.diffraction.distance_parameters import AroundEdge


@dataclass(frozen=True)
class Diffraction:
    """The diffraction of paths at an edge each."""

    wedges: Wedge  # all edges
    edge: mi.UInt  # index of each path's edge
    around: AroundEdge  # the way around it
    sheets: bool  # whether there may be edges of sheets among them

    def __call__(self, surfaces: Surfaces, field: Field, way_in: mi.Vector3f, way_out: mi.Vector3f) -> Field:
        """The field behind the edge, without the phase and the spreading on the way."""
        wedge, k = self.wedges.gathered(self.edge), surfaces.wavenumber
        n = mi.Float(wedge.exterior / dr.pi)
        angle_in, angle_out, _, _, sin_beta, *detours, excess, length = (mi.Float(each) for each in self.around)
        direct, reflected = transition_pairs(angle_out, angle_in, n, length, k)
        # Unit vectors perpendicular to the plane of edge and ray, before and behind the edge.
        along = mi.Vector3f(wedge.direction)
        phi_in, phi_out = dr.normalize(dr.cross(way_in, along)), dr.normalize(dr.cross(along, way_out))
        found = composed(
            (reflected - direct) * component(field, dr.cross(phi_in, way_in)),
            dr.cross(phi_out, way_out),
            -(direct + reflected) * component(field, phi_in),
            phi_out,
        )
        if self.sheets:
            normal, face = mi.Vector3f(wedge.normal), wedge.face
            driven, sending = (
                currents(way, normal, *surfaces.centred_coefficients(face, dr.abs(dr.dot(way, normal))))
                for way in (way_in, way_out)
            )
            pairs = direct, reflected
            sheet = behind_sheet(
                field, way_in, way_out, normal, driven, sending, (angle_in, angle_out), pairs, sin_beta
            )
            # The slab's middle may lie beside the triangle. A wave that is scattered there has another way.
            middle = surfaces.middle(face) * dr.dot(surfaces.normal(face), way_out - way_in)
            sheet = turned(sheet, dr.exp(mi.Complex2f(0, k * middle)))
            found = dr.select(wedge.sheet, sheet[0], found[0]), dr.select(wedge.sheet, sheet[1], found[1])
        weight = end_weight(detours, excess, k) * common_factor(n, sin_beta, k)
        return turned(found, weight)


def transition_pairs(
    phi: mi.Float, phi_source: mi.Float, n: mi.Float, length: mi.Float, wavenumber: mi.Float | float
) -> tuple[mi.Complex2f, mi.Complex2f]:
    """The sums d₁ + d₂ and d₃ + d₄ of the uniform theory of a conducting wedge [kouyoumjian1974].

    The open space around the edge has the angle nπ. The source is at the angle φ′ from face 0, and the target at φ.
    With the distances s′ and s to the edge, the angle β₀ between ray and edge, and L = s s′/(s + s′) · sin² β₀,

        D_s, D_h = −e^{−jπ/4} / (2n √(2πk) sin β₀) · [d₁ + d₂ ∓ (d₃ + d₄)],
        d₁, d₂ = cot((π ± (φ − φ′))/2n) F(kL a±(φ − φ′)),    d₃, d₄ = cot((π ± (φ + φ′))/2n) F(kL a±(φ + φ′)),

    with the transition function F and a±(β) = 2 cos²((2nπN± − β)/2), where N± is the integer nearest to (β ± π)/2πn.
    D_s belongs to an electric field along the edge (soft), D_h to one across it (hard). Without F the sums would be
    singular at the shadow and the reflection boundary.
    """

    def pair(beta: mi.Float) -> mi.Complex2f:
        result = mi.Complex2f(0)
        for sign in (1, -1):
            turns = dr.round((beta + sign * dr.pi) / (2 * dr.pi * n))
            a = 2 * dr.square(dr.cos((2 * dr.pi * n * turns - beta) / 2))
            psi = (dr.pi + sign * beta) / (2 * n)
            result += rt_utils.cot_times_f_utd(psi, wavenumber * length * a, n, wavenumber * length)
        return result

    return pair(phi - phi_source), pair(phi + phi_source)


def common_factor(n: mi.Float, sin_beta: mi.Float, wavenumber: mi.Float | float) -> mi.Complex2f:
    """−e^{−jπ/4} / (2n √(2πk) sin β₀), √metres."""
    return mi.Complex2f(-1, 1) / dr.sqrt(2) / (2 * n * dr.sqrt(2 * dr.pi * wavenumber) * sin_beta)


def end_weight(detours: Sequence[mi.Float], excess: mi.Float, wavenumber: mi.Float | float) -> mi.Complex2f:
    """The share of a wave that both ends of an edge leave.

    Consider an opening with a corner, which is open for x, y > 0. Behind it, Kirchhoff's integral gives the wave
    F(x)F(y), where F is the Fresnel integral from −∞. Geometric optics gives the product of steps θ(x)θ(y). For any λ

        θ(x)θ(y) − F(x)F(y) = [θ(x) − F(x)] · [λ F(y) + (1 − λ) θ(y)] + [θ(y) − F(y)] · [λ θ(x) + (1 − λ) F(x)].

    The first bracket of each term is the wave diffracted at an edge without an end. The second is the share of this
    wave that the end leaves. We weight the waves of the uniform theory in this way, with λ = p/(p + q). Here p is the
    detour of the diffracted wave compared to the direct or reflected one; it is 0 at the boundary where the latter
    ends. q is the detour by the end of the edge. Each wave is then continuous where its point of diffraction passes the
    end, and complete where it makes up for a direct or reflected wave.

    The Fresnel integral of an end is

        f(u) = e^{jπ/4}/√π · ∫_{−∞}^{u} e^{−jt²} dt,    u² = kq,

    where u is positive if the point of diffraction is on the edge. A distant end has little effect. So f(u) approaches
    the step in proportion to q, and equals it beyond ``REACH``.
    """
    weight = mi.Complex2f(-1)
    for detour in detours:
        step = dr.select(detour >= 0, mi.Float(1), mi.Float(0))
        # Sionna's integral is the conjugate of ours, from 0 to |u|, over √(π/2).
        half = dr.conj(rt_utils.fresnel(wavenumber * dr.abs(detour))) * (2 * step - 1)
        integral = 0.5 + mi.Complex2f(0.5, 0.5) * half
        felt = dr.clip(1 - wavenumber * dr.abs(detour) / (2 * dr.pi * REACH), 0, 1)
        share = excess / (excess + dr.abs(detour) + 1e-9)
        weight += step + felt * share * (integral - step)
    return weight


GRAZING = 1e-3  # Smallest cosine of an angle of incidence


class Currents(NamedTuple):
    """The currents that a wave drives, or that send a wave: a, b, c, d, and the unit vectors along the currents."""

    a: mi.Complex2f
    b: mi.Complex2f
    c: mi.Complex2f
    d: mi.Complex2f
    across: mi.Vector3f
    along: mi.Vector3f


def currents(way: mi.Vector3f, normal: mi.Vector3f, r_te, r_tm, t_te, t_tm) -> Currents:
    """The currents of a plane wave in a dielectric sheet, a half-plane that reflects waves and lets them pass.

    A thin sheet scatters by the currents in it. A wave with the angle of incidence θ drives four kinds of currents.
    They send different waves to the two sides, so their amplitudes follow from the coefficients R of reflection and T
    of transmission:

        along the sheet, E across the plane of incidence (TE)    a² = (1 − T − R)/2 · cos θ,
        along it, in the plane of incidence (TM)                 b² = (1 − T + R)/2 / cos θ,
        across it (TM)                                           c² = (1 − T − R)/2 · cos θ / sin² θ,
        loops of current, which a magnetic current stands for    d² = (1 − T + R)/2 / cos θ    (TE).

    A piece of a weakly scattering sheet scatters a wave in proportion to a a′ (likewise for b, c, d) times the product
    of both waves' unit vectors along the current. Here a belongs to the incident and a′ to the outgoing wave. For a
    thin sheet this is the Born approximation (a² = jkt(ε − 1)/2). In the directions of reflection and transmission it
    is right for any sheet. Summed over the half-plane, with the angles φ′ and φ about its edge, it gives

        D = −e^{−jπ/4} / (2√(2πk) sin² β₀) · N / (2 cos((φ − φ′)/2) cos((φ + φ′)/2)),    N the negative sum of the four.

    With c∓ = cos((φ ∓ φ′)/2) and C = c₊² + c₋², N/(c₋c₊) = (N c₊/C)/c₋ + (N c₋/C)/c₊. The first term is singular at the
    shadow boundary, the second at the reflection boundary. Each is multiplied by the transition function of the uniform
    theory (``transition_pairs``). At these boundaries the sum then makes up for the jump of T − 1 or R in geometric
    optics.
    """
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
    """The field diffracted at the edge of a sheet, over ``common_factor``, without phase and spreading."""
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
