"""Arrays that move, alone or with the transmitter, by reciprocity.

By reciprocity the response between two antennas is the same whichever of them transmits. So a fixed transmitter and a
moving array are simulated as one fixed antenna, whose field is wanted at the places of the array's elements.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import cast

import numpy as np
from jaxtyping import Complex, Float
from scipy.spatial.transform import Rotation

from scenes.checks.occupancy import element_positions
from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.description import Scene
from scenes.scene.orientation import GATEWAY_FROM_TRANSMITTER
from simulate.engines.engine import BandSource, ResponseSource
from simulate.spectra.band import Band


def element_offsets(gateway: Gateway, wavelength: float) -> np.ndarray:
    """Where the elements are from the middle of the array, metres, axes of the world frame, [elements, 3]."""
    return element_positions(replace(gateway, position=(0.0, 0.0, 0.0)), wavelength)


def reciprocal(scene: Scene, place: Sequence[float]) -> Scene:
    """The scene with an antenna of the transmitter's kind at a place as gateway, and an element's as transmitter."""
    gateway, transmitter = scene.gateway, scene.transmitter
    offsets = element_offsets(gateway, scene.wavelength)
    low, high = transmitter.region[0] + offsets.min(axis=0), transmitter.region[1] + offsets.max(axis=0)
    of_transmitter = Rotation.from_quat(transmitter.orientation) * GATEWAY_FROM_TRANSMITTER.inv()
    of_element = Rotation.from_quat(gateway.orientation) * GATEWAY_FROM_TRANSMITTER
    return replace(
        scene,
        gateway=Gateway(
            (place[0], place[1], place[2]),
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


@dataclass(frozen=True)
class MovingArray:
    """Computes the responses of all elements of an array at some place to a transmitter at one of several places."""

    places: Float[np.ndarray, "N 3"]  # the places of the transmitter, metres, world frame
    # for each of them, computes the responses of an antenna that stands there to antennas in the region
    sources: Sequence[ResponseSource]
    # where the elements are from the middle of the array, metres, axes of the world frame
    offsets: Float[np.ndarray, "elements 3"]

    def responses(self, pairs: Float[np.ndarray, "K 6"]) -> Complex[np.ndarray, "K elements"]:
        """Element responses of pairs: transmitter and middle of the array, x, y, z each, metres, world frame."""
        return self._of_each(pairs, lambda source, antennas: source.responses(antennas))

    def band_responses(
        self, pairs: Float[np.ndarray, "K 6"], band: Band
    ) -> Complex[np.ndarray, "K elements subcarriers"]:
        return self._of_each(pairs, lambda source, antennas: cast(BandSource, source).band_responses(antennas, band))

    def _of_each(
        self,
        pairs: Float[np.ndarray, "K 6"],
        responses: Callable[[ResponseSource, Float[np.ndarray, "n 3"]], Complex[np.ndarray, "n 1 *band"]],
    ) -> Complex[np.ndarray, "K elements *band"]:
        transmitters, arrays = np.split(pairs, 2, axis=1)
        found, order = [], []
        for place, source in zip(self.places, self.sources, strict=True):
            chosen = np.flatnonzero((transmitters == place).all(axis=1))
            if len(chosen):
                of_antennas = responses(source, (arrays[chosen][:, None] + self.offsets).reshape(-1, 3))
                found.append(of_antennas.reshape(len(chosen), len(self.offsets), *of_antennas.shape[2:]))
                order.append(chosen)
        return np.concatenate(found)[np.argsort(np.concatenate(order))]
