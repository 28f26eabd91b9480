"""Responses of an array that moves, from the field of a fixed antenna at the places of its elements."""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

import numpy as np
from jaxtyping import Complex, Float

from simulate.engines.engine import BandSource, ResponseSource
from simulate.spectra.band import Band


@dataclass(frozen=True)
class AtElements:
    """Computes the responses of all elements of an array whose middle is at some position.

    By reciprocity, the response of an element to the fixed transmitter is that of the transmitter to the element.
    """

    source: ResponseSource  # computes the responses of one fixed antenna to antennas anywhere in the region
    # where the elements are from the middle of the array, metres, axes of the world frame
    offsets: Float[np.ndarray, "elements 3"]

    def responses(self, positions: Float[np.ndarray, "K 3"]) -> Complex[np.ndarray, "K elements"]:
        """Element responses with the array at each position, metres, world frame."""
        return self.source.responses(self._places(positions)).reshape(len(positions), -1)

    def band_responses(
        self, positions: Float[np.ndarray, "K 3"], band: Band
    ) -> Complex[np.ndarray, "K elements subcarriers"]:
        """Element responses at all subcarriers with the array at each position, metres, world frame."""
        found = cast(BandSource, self.source).band_responses(self._places(positions), band)
        return found.reshape(len(positions), len(self.offsets), -1)

    def _places(self, positions: Float[np.ndarray, "K 3"]) -> Float[np.ndarray, "K*elements 3"]:
        return (positions[:, None] + self.offsets).reshape(-1, 3)
