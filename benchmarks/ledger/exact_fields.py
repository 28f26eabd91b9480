"""Exact responses between short dipoles, in free space and beside a conducting half-plane."""

from __future__ import annotations

from typing import Literal

import numpy as np
from jaxtyping import Complex, Float
from scipy.integrate import quad_vec
from scipy.special import hankel2

from scenes.scene.description import SPEED_OF_LIGHT
from simulate.fullwave.dipole import GAIN


def free_space_response(
    source: Float[np.ndarray, " 3"],
    direction: Float[np.ndarray, " 3"],
    positions: Float[np.ndarray, "K 3"],
    transmitter: Float[np.ndarray, " 3"],
    frequency: float,
) -> Complex[np.ndarray, " K"]:
    """Response between two short dipoles in free space, near field included (Balanis, Antenna Theory, chapter 4).

    It is y = 1.5 λ / (−jωμ₀) · E·q / Iℓ, with the direction q of the transmitter's dipole and

    E = −jωμ₀ Iℓ e^{−jkr}/4πr · [(p − u u·p)(1 + 1/jkr + 1/(jkr)²) − 2 u u·p (1/jkr + 1/(jkr)²)]

    with the direction p of the source's dipole and the unit vector u from the source to the position.
    """
    wavelength = SPEED_OF_LIGHT / frequency
    distance = np.linalg.norm(positions - source, axis=1)
    unit = (positions - source) / distance[:, None]
    along = unit @ direction
    inverse = 1 / (2j * np.pi / wavelength * distance)
    near = inverse + inverse**2
    across = direction @ transmitter - (unit @ transmitter) * along
    field = across * (1 + near) - 2 * (unit @ transmitter) * along * near
    return GAIN * wavelength / (4 * np.pi * distance) * np.exp(-2j * np.pi * distance / wavelength) * field


def half_plane_response(
    source: Float[np.ndarray, " 3"], positions: Float[np.ndarray, "K 3"], frequency: float
) -> Complex[np.ndarray, " K"]:
    """Response between short dipoles along z beside the conducting half-plane x = 0, y < 0.

    Its edge is the z axis. A dipole parallel to the edge has a Hertz vector along z, which vanishes on the plane.
    Macdonald [macdonald1915] solved this case ([bowman1969], chapter 8). With the distances R from the source and R′
    from its image,

        G = g(R, m) − g(R′, m′),
        g(R, m) = k/(8πj) · ∫_{−∞}^{T} H₁⁽²⁾(kR cosh t) dt,   sinh T = m / kR,
        m = 2k √(ρρ₀) cos((φ − φ₀)/2),   m′ = 2k √(ρρ₀) cos((φ + φ₀)/2),

    where ρ is the distance from the edge and φ the angle from the half-plane. The index 0 marks those of the source.

    It is y = 1.5 λ (1 + ∂²/∂z² / k²) G, and ``|y|²`` is the channel gain.

    Example:
        >>> source = np.array([-1.0, 0.3, 0.0])
        >>> lit_and_shadow = half_plane_response(source, np.array([[1.0, 0.5, 0.0], [1.0, -2.0, 0.0]]), 915e6)
        >>> np.round(20 * np.log10(np.abs(lit_and_shadow)), 1).tolist()
        [-32.7, -62.5]
    """
    wavenumber = 2 * np.pi * frequency / SPEED_OF_LIGHT
    step = 0.1 / wavenumber  # metres
    weights = {-2: -1 / 12, -1: 4 / 3, 0: -5 / 2, 1: 4 / 3, 2: -1 / 12}  # second difference of fourth order
    values = {
        number: half_plane_green(source, positions + number * step * np.array([0, 0, 1]), wavenumber)
        for number in weights
    }
    second = sum(weight * values[number] for number, weight in weights.items()) / step**2
    return GAIN * 2 * np.pi / wavenumber * (values[0] + second / wavenumber**2)


def half_plane_green(
    source: Float[np.ndarray, " 3"],
    positions: Float[np.ndarray, "K 3"],
    wavenumber: float,
    image: Literal[-1, 1] = -1,
) -> Complex[np.ndarray, " K"]:
    """The scalar wave G of a point source beside a half-plane. In free space it would be e^{−jkR}/4πR."""

    def around_edge(points: Float[np.ndarray, "n 3"]) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, " n"]]:
        angle = np.arctan2(points[:, 0], -points[:, 1])  # 0 on the half-plane, positive where x > 0
        return np.hypot(points[:, 0], points[:, 1]), np.where(angle < 0, angle + 2 * np.pi, angle)

    (radius,), (angle,) = around_edge(source[None])
    radii, angles = around_edge(positions)
    total = np.zeros(len(positions), complex)
    for sign, factor in ((1, 1), (-1, image)):
        across = radii**2 + radius**2 - 2 * radii * radius * np.cos(angles - sign * angle)
        distance = np.sqrt(across + (positions[:, 2] - source[2]) ** 2)
        m = 2 * np.sqrt(radii * radius) * np.cos((angles - sign * angle) / 2)
        total += factor * _wave(wavenumber * distance, np.arcsinh(m / distance)) * wavenumber
    return total


def _wave(phase: Float[np.ndarray, " K"], until: Float[np.ndarray, " K"]) -> Complex[np.ndarray, " K"]:
    """g / k for kR = ``phase`` and T = ``until``."""

    def tail(start: Float[np.ndarray, " K"]) -> Complex[np.ndarray, " K"]:
        """∫ of H₁⁽²⁾(kR cosh t) from a start that is not negative to ∞, along a path on which the integrand decays."""

        def integrand(s: float) -> Complex[np.ndarray, " K"]:
            bend = np.pi / 4
            t = start + s - 1j * bend * np.tanh(s)
            return hankel2(1, phase * np.cosh(t)) * (1 - 1j * bend / np.cosh(s) ** 2)

        start = np.minimum(start, 10)  # the integral beyond is negligible
        return quad_vec(integrand, 0, 6, epsabs=1e-12, epsrel=1e-10)[0]

    whole = 2j * np.exp(-1j * phase) / phase
    rest = tail(np.abs(until))
    return np.where(until < 0, rest, whole - rest) / (8j * np.pi)
