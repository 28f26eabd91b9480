"""The method mirror-images for received powers: waves of the gateways' mirror images, and kriging of the rest in dB."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from jaxtyping import Float, Int

from learn.powers.explained_powers import ExplainedPowers
from learn.powers.known_powers import KnownPowers
from learn.powers.power_images import PowerImages
from simulate.spectra.spectrum import evenly

FOLDS = 5
"""Parts of the known positions. The images that predict each part are found without it."""

LEAST_KNOWN = 20
"""With fewer known positions no images are looked for, and the method is ``helmholtz``."""

FITTED_ON = 300
"""Largest number of known positions, evenly spread, in which images are found. All known positions are kriged."""

AT_ONCE = 16
"""Largest number of gateways whose images are found together."""


class MirrorPowers(ExplainedPowers):
    """Universal kriging in dB about the powers of the gateways and their mirror images.

    ``PowerImages`` predicts T. At a known position, it is predicted without the position's part of the known ones.

    Walls are taken to run along the axes of the world frame. The gateways must be where the dataset says.
    """

    NAME: ClassVar[str] = "mirror-images"

    def fit(self, known: KnownPowers) -> None:
        count = len(known.positions)
        self._images: list[PowerImages] = []
        self._of_known = np.zeros_like(known.powers)
        if count >= LEAST_KNOWN:
            for fold in range(FOLDS):
                part = np.arange(count) % FOLDS == fold
                self._images = _found(known, np.flatnonzero(~part))
                self._of_known[part] = self._explained(known.positions[part])
            self._images = _found(known, np.arange(count))
        super().fit(known)

    def _explained(self, positions: Float[np.ndarray, "K 3"]) -> Float[np.ndarray, "K G"]:
        if not self._images:
            return np.zeros((len(positions), self._of_known.shape[1]))
        return np.concatenate([each.predict(positions) for each in self._images], axis=1)


def _found(known: KnownPowers, members: Int[np.ndarray, " m"]) -> list[PowerImages]:
    """Images of all gateways, in groups of these, found in some of the known powers."""
    region = np.stack([known.positions.min(axis=0), known.positions.max(axis=0)])
    members = evenly(members, FITTED_ON)
    found = []
    for group in np.array_split(np.arange(len(known.gateways)), -(-len(known.gateways) // AT_ONCE)):
        images = PowerImages(known.gateways[group], region, known.wavelength)
        images.fit(known.positions[members], known.filled[members][:, group])
        found.append(images)
    return found
