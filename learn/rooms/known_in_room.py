"""What a method is told of a room: some of its spectra."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from simulate.dataset.dataset import Dataset


@dataclass(frozen=True)
class KnownInRoom:
    """What is known of a room: some of its spectra."""

    dataset: Dataset  # the room's dataset; a method must use the known spectra alone
    known: Int[np.ndarray, " L"]  # their indices, in the order in which they became known
    seed: int  # seed of everything that is random in the method itself

    @property
    def positions(self) -> Float[np.ndarray, "L 3"]:
        """Transmitter positions of the known spectra, metres, world frame."""
        return self.dataset.positions[self.known]

    @property
    def spectra(self) -> Float[np.ndarray, "L 90 360"]:
        """The known spectra, 0…1."""
        return self.dataset.spectra[self.known]
