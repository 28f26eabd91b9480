"""What is left of a diffracted wave at the ends of an edge.

Behind an opening with a corner, x, y > 0 seen from there, Kirchhoff's integral gives the wave F(x)F(y), where F is the
Fresnel integral from −∞, and geometric optics the product of steps θ(x)θ(y). For any λ

    θ(x)θ(y) − F(x)F(y) = [θ(x) − F(x)] · [λ F(y) + (1 − λ) θ(y)] + [θ(y) − F(y)] · [λ θ(x) + (1 − λ) F(x)].

The first bracket of each term is the wave diffracted at an edge that has no end, the second what its end leaves of it.
We weight the waves of the uniform theory so, with λ = p/(p + q): p is the detour that the diffracted wave makes over
the direct or reflected one, 0 at the boundary where that ends, and q the detour by the end of the edge. Each wave then
is continuous where its point of diffraction passes the end, and whole where it makes up for a direct or reflected wave.

The Fresnel integral of an end is

    f(u) = e^{jπ/4}/√π · ∫_{−∞}^{u} e^{−jt²} dt,    u² = kq,

u positive where the point of diffraction is on the edge's side of the end. A distant end has little effect, and f(u) is
drawn towards the step in proportion to q, which it is beyond ``REACH``.
"""

from __future__ import annotations

from collections.abc import Sequence

from sionna.rt.utils import fresnel

from simulate.rays.core.ray_tracer import dr, mi

REACH = 0.5
"""Wavelengths; ends with a longer detour are not felt."""


def end_weight(detours: Sequence[mi.Float], excess: mi.Float, wavelength: float) -> mi.Complex2f:
    """What both ends of an edge leave of a wave.

    Args:
        detours: q of start and end, metres; negative where the point of diffraction lies beyond that end.
        excess: p, metres.
        wavelength: metres.

    >>> start, end = mi.Float([9.0, 0.0, -9.0]), mi.Float([9.0, 9.0, 9.0])
    >>> end_weight((start, end), mi.Float([1.0, 1.0, 1.0]), 0.3).real.numpy().round(2).tolist()
    [1.0, 0.5, 0.0]
    """
    weight = mi.Complex2f(-1)
    for detour in detours:
        step = dr.select(detour >= 0, mi.Float(1), mi.Float(0))
        # Sionna's integral is the conjugate of ours, from 0 to |u|, over √(π/2).
        half = dr.conj(fresnel(2 * dr.pi / wavelength * dr.abs(detour))) * (2 * step - 1)
        integral = 0.5 + mi.Complex2f(0.5, 0.5) * half
        felt = dr.clip(1 - dr.abs(detour) / (REACH * wavelength), 0, 1)
        share = excess / (excess + dr.abs(detour) + 1e-9)
        weight += step + felt * share * (integral - step)
    return weight
