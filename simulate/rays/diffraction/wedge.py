"""The uniform theory of diffraction at a conducting wedge [kouyoumjian1974].

The open space around the edge has the angle nπ. The source is at the angle φ′ from face 0, and the target at φ. With
the distances s′ and s to the edge, the angle β₀ between ray and edge, and L = s s′/(s + s′) · sin² β₀,

    D_s, D_h = −e^{−jπ/4} / (2n √(2πk) sin β₀) · [d₁ + d₂ ∓ (d₃ + d₄)],
    d₁, d₂ = cot((π ± (φ − φ′))/2n) F(kL a±(φ − φ′)),    d₃, d₄ = cot((π ± (φ + φ′))/2n) F(kL a±(φ + φ′)),

with the transition function F and a±(β) = 2 cos²((2nπN± − β)/2), where N± is the integer nearest to (β ± π)/2πn. D_s
belongs to an electric field along the edge (soft), D_h to one across it (hard).
"""

from __future__ import annotations

from simulate.rays.core.ray_tracer import dr, mi, rt_utils


def transition_pairs(
    phi: mi.Float, phi_source: mi.Float, n: mi.Float, length: mi.Float, wavenumber: mi.Float | float
) -> tuple[mi.Complex2f, mi.Complex2f]:
    """The sums d₁ + d₂ and d₃ + d₄. Without F they would be singular at the shadow and the reflection boundary."""

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


def wedge_coefficients(
    phi: mi.Float, phi_source: mi.Float, n: mi.Float, length: mi.Float, sin_beta: mi.Float, wavenumber: mi.Float | float
) -> tuple[mi.Complex2f, mi.Complex2f]:
    """D_s and D_h, √metres."""
    direct, reflected = transition_pairs(phi, phi_source, n, length, wavenumber)
    factor = common_factor(n, sin_beta, wavenumber)
    return factor * (direct - reflected), factor * (direct + reflected)
