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

import numpy as np
from jaxtyping import Complex, Float
from scipy.special import fresnel

REACH = 0.5
"""Wavelengths; ends with a longer detour are not felt."""


def end_weight(
    detours: Float[np.ndarray, "n 2"], excess: Float[np.ndarray, " n"], wavelength: float
) -> Complex[np.ndarray, " n"]:
    """What both ends of an edge leave of a wave.

    Args:
        detours: q of start and end, metres; negative where the point of diffraction lies beyond that end.
        excess: p, metres.
        wavelength: metres.

    >>> detours = np.array([[9.0, 9.0], [0.0, 9.0], [-9.0, 9.0]])
    >>> end_weight(detours, np.array([1.0, 1.0, 1.0]), 0.3).round(2).real.tolist()
    [1.0, 0.5, 0.0]
    """
    u = np.sign(detours) * np.sqrt(2 * np.pi / wavelength * np.abs(detours))
    # scipy's integrals are of cos and sin of πt²/2, from 0 on.
    sine, cosine = fresnel(u * np.sqrt(2 / np.pi))
    integral = 0.5 + np.exp(1j * np.pi / 4) / np.sqrt(2) * (cosine - 1j * sine)
    step = detours >= 0
    felt = np.clip(1 - np.abs(detours) / (REACH * wavelength), 0, 1)
    shares = excess[:, None] / (excess[:, None] + np.abs(detours) + 1e-12)
    return (step + felt * shares * (integral - step)).sum(axis=1) - 1
