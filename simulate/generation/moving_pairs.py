"""Responses of pairs whose both ends move, from the fields of fixed antennas at the places of the transmitter."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Float

from simulate.engines.engine import ResponseSource
from simulate.generation.moving_receiver import AtElements
from simulate.spectra.band import Band


@dataclass(frozen=True)
class AtPairs:
    """Computes the responses of all elements of an array at some place to a transmitter at one of several places."""

    places: Float[np.ndarray, "N 3"]  # the places of the transmitter, metres, world frame
    # for each of them, computes the responses of an antenna that stands there to antennas in the region
    sources: Sequence[ResponseSource]
    # where the elements are from the middle of the array, metres, axes of the world frame
    offsets: Float[np.ndarray, "elements 3"]

    def responses(self, pairs: Float[np.ndarray, "K 6"]) -> Complex[np.ndarray, "K elements"]:
        """Element responses of pairs: transmitter and middle of the array, x, y, z each, metres, world frame."""
        return self._of_each(pairs, lambda source, arrays: source.responses(arrays))

    def band_responses(
        self, pairs: Float[np.ndarray, "K 6"], band: Band
    ) -> Complex[np.ndarray, "K elements subcarriers"]:
        """Element responses of pairs at all subcarriers."""
        return self._of_each(pairs, lambda source, arrays: source.band_responses(arrays, band))

    def _of_each(
        self,
        pairs: Float[np.ndarray, "K 6"],
        responses: Callable[[AtElements, Float[np.ndarray, "n 3"]], Complex[np.ndarray, "n elements *band"]],
    ) -> Complex[np.ndarray, "K elements *band"]:
        transmitters, arrays = np.split(pairs, 2, axis=1)
        found, order = [], []
        for place, source in zip(self.places, self.sources, strict=True):
            chosen = np.flatnonzero((transmitters == place).all(axis=1))
            if len(chosen):
                found.append(responses(AtElements(source, self.offsets), arrays[chosen]))
                order.append(chosen)
        return np.concatenate(found)[np.argsort(np.concatenate(order))]
