"""A scene with the roles of its antennas exchanged, for a receiver that moves.

By reciprocity the response between two antennas is the same whichever of them transmits. So a fixed transmitter and a
moving array are simulated as one fixed antenna, whose field is wanted at the places of the array's elements.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from scenes.checks.occupancy import element_positions
from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.description import Scene
from scenes.scene.orientation import GATEWAY_FROM_TRANSMITTER


def element_offsets(gateway: Gateway, wavelength: float) -> np.ndarray:
    """Where the elements are from the middle of the array, metres, axes of the world frame, [elements, 3].

    >>> element_offsets(Gateway((1, 0, 2), (0, 0, 0, 1), rows=1, columns=2), wavelength=0.2).tolist()
    [[-0.05, 0.0, 0.0], [0.05, 0.0, 0.0]]
    """
    return element_positions(replace(gateway, position=(0.0, 0.0, 0.0)), wavelength)


def reciprocal(scene: Scene, place: Sequence[float] | None = None) -> Scene:
    """The scene whose gateway is one antenna of the transmitter's kind, and whose transmitter is an element's antenna.

    Example:
        >>> from scenes.places.closet import closet
        >>> other = reciprocal(closet())
        >>> other.gateway.rows * other.gateway.columns, other.gateway.position == closet().gateway.position
        (1, True)
    """
    gateway, transmitter = scene.gateway, scene.transmitter
    offsets = element_offsets(gateway, scene.wavelength)
    low, high = transmitter.region[0] + offsets.min(axis=0), transmitter.region[1] + offsets.max(axis=0)
    of_transmitter = Rotation.from_quat(transmitter.orientation) * GATEWAY_FROM_TRANSMITTER.inv()
    of_element = Rotation.from_quat(gateway.orientation) * GATEWAY_FROM_TRANSMITTER
    return replace(
        scene,
        gateway=Gateway(
            gateway.position if place is None else (place[0], place[1], place[2]),
            tuple(of_transmitter.as_quat().tolist()),
            rows=1,
            columns=1,
            pattern=transmitter.pattern,
            polarization=transmitter.polarization,
        ),
        transmitter=Transmitter(
            tuple(low.tolist()),
            tuple(high.tolist()),
            pattern=gateway.pattern,
            polarization=gateway.polarization,
            orientation=tuple(of_element.as_quat().tolist()),
        ),
    )
