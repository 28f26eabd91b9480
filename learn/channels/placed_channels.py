"""The downlink from the row's own uplink and from the channels of known rows nearby."""

from __future__ import annotations

import numpy as np
from jaxtyping import Complex, Float

from learn.channels.joint_channels import JointChannels
from learn.channels.known_channels import KnownChannels, PredictedChannels
from learn.models.kriging.band_field import BandField
from scenes.files.plain_text import say
from simulate.spectra.array import PlanarArray
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.spectrum import evenly

MOST_LEFT_OUT = 400
"""Largest number of known rows, evenly spread, that are predicted from the others."""

LEAST_ROWS = 6
"""With fewer known rows, their places are not used."""

LEAST_GAIN = 0.01
"""If the places explain a smaller share of the power of left-out rows, they are not used."""


class PlacedChannels:
    """Both links as one field over the place, and what it leaves of the downlink from what it leaves of the uplink.

    ``BandField`` predicts both links of a row from the known rows nearby. Of a row's own uplink, it leaves y_u − ŷ_u.
    ``JointChannels``, fitted to what is left of known rows that are predicted from the others, estimates y_d − ŷ_d from
    it. Two such steps are the linear minimum-mean-square-error estimate from the row's own uplink and its neighbours
    together. If the places tell nothing, as where each row has a phase of its own, this is ``JointChannels`` alone. The
    stated deviation is in proportion to what is left of the row's uplink, which shows how well the places predict it.
    """

    # the fitted field of both links. None: the places are not used. Set by ``fit``, as the next.
    field: BandField | None
    found: str  # what the fit found, in words

    def fit(self, known: KnownChannels) -> None:
        self.field, self.found = None, "does not use places"
        self._rest = JointChannels()
        both = np.concatenate([known.uplink, known.downlink], axis=2).astype(complex)
        if known.positions is None:
            say("helmholtz-positions: the positions (tx_pos.csv) are not known, so it is the same as helmholtz")
        elif len(both) >= LEAST_ROWS:
            left = self._left_by_places(both, known.positions, known.wavelength)
            if self.field is not None:
                known = KnownChannels(*np.split(left, 2, axis=2), seed=known.seed)
        self._rest.fit(known)

    def _left_by_places(
        self, both: Complex[np.ndarray, "n A 2S"], positions: Float[np.ndarray, "n 3"], wavelength: float
    ) -> Complex[np.ndarray, "m A 2S"]:
        """Fit the field, and return what it leaves of known rows that it predicts from the others."""
        region = np.stack([positions.min(axis=0), positions.max(axis=0)])
        field = BandField(region, Beamformer(PlanarArray(1, both.shape[1])), wavelength)
        found = field.fit_to(positions, both, None, np.arange(len(both), dtype=float))
        out = evenly(np.arange(len(both)), MOST_LEFT_OUT)
        left = both[out] - field.at(positions[out], out)[0]
        power, unexplained = (float(np.square(np.abs(each)).sum()) for each in (both[out], left))
        if unexplained < (1 - LEAST_GAIN) * power:
            self.field, self.found = field, f"{found}; places explain {1 - unexplained / power:.0%} of the power"
            say(f"helmholtz-positions: {self.found}")
        return left

    def predict(
        self, uplink: Complex[np.ndarray, "K A S"], positions: Float[np.ndarray, "K 3"] | None = None
    ) -> PredictedChannels:
        if self.field is None or positions is None:
            return self._rest.predict(uplink)
        up, down = np.split(self.field.at(positions)[0], 2, axis=2)
        rest = self._rest.predict(uplink - up)
        return PredictedChannels(down + rest.downlink, rest.deviation)
