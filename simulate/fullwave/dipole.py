"""Short dipoles, which are the antennas of the full-wave engine, and their response in free space."""

from __future__ import annotations

import numpy as np
from jaxtyping import Complex, Float
from scipy.spatial.transform import Rotation

from scenes.scene.description import SPEED_OF_LIGHT, Scene

GAIN = 1.5
"""Gain of a short dipole."""


def element_direction(scene: Scene) -> Float[np.ndarray, " 3"]:
    """Direction of the gateway's dipoles, along its y axis ("V") or x axis ("H"); unit vector, world frame."""
    axis = [0.0, 1.0, 0.0] if scene.gateway.polarization == "V" else [1.0, 0.0, 0.0]
    return Rotation.from_quat(scene.gateway.orientation).apply(axis)


def transmitter_direction(scene: Scene) -> Float[np.ndarray, " 3"]:
    """Direction of the transmitter's dipole, along its z axis ("V") or y axis ("H"); unit vector, world frame."""
    axis = [0.0, 0.0, 1.0] if scene.transmitter.polarization == "V" else [0.0, 1.0, 0.0]
    return Rotation.from_quat(scene.transmitter.orientation).apply(axis)


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
