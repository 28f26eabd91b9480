"""The effect of the ends of an edge on a diffracted wave.

Consider an opening with a corner, which is open for x, y > 0. Behind it, Kirchhoff's integral gives the wave F(x)F(y),
where F is the Fresnel integral from −∞. Geometric optics gives the product of steps θ(x)θ(y). For any λ

    θ(x)θ(y) − F(x)F(y) = [θ(x) − F(x)] · [λ F(y) + (1 − λ) θ(y)] + [θ(y) − F(y)] · [λ θ(x) + (1 − λ) F(x)].

The first bracket of each term is the wave diffracted at an edge without an end. The second is the share of this wave
that the end leaves. We weight the waves of the uniform theory in this way, with λ = p/(p + q). Here p is the detour of
the diffracted wave compared to the direct or reflected one; it is 0 at the boundary where the latter ends. q is the
detour by the end of the edge. Each wave is then continuous where its point of diffraction passes the end, and complete
where it makes up for a direct or reflected wave.

The Fresnel integral of an end is

    f(u) = e^{jπ/4}/√π · ∫_{−∞}^{u} e^{−jt²} dt,    u² = kq,

where u is positive if the point of diffraction is on the edge. A distant end has little effect. So f(u) approaches the
step in proportion to q, and equals it beyond ``REACH``.
"""

from __future__ import annotations

from collections.abc import Sequence

from simulate.rays.core.ray_tracer import dr, mi, rt_utils

REACH = 0.5
"""Wavelengths. Ends with a longer detour have no effect."""


def end_weight(detours: Sequence[mi.Float], excess: mi.Float, wavenumber: mi.Float | float) -> mi.Complex2f:
    """The share of a wave that both ends of an edge leave.

    Example:
        >>> start, end = mi.Float([9.0, 0.0, -9.0]), mi.Float([9.0, 9.0, 9.0])
        >>> end_weight((start, end), mi.Float([1.0, 1.0, 1.0]), 20.0).real.numpy().round(2).tolist()
        [1.0, 0.5, 0.0]
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
