"""Kriging of responses over a band: without any physics, and with waves of directions and delays."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from learn.band.known_band import KnownBand, PredictedBand
from learn.baselines.kriging import Interpolator
from learn.models.kriging.band_field import BandField

COMPONENTS = 8
"""Largest number of principal components over the subcarriers that ``Kriging`` interpolates."""


class Kriging:
    """Gaussian-process interpolation of all subcarriers, with one squared-exponential kernel for all.

    With one kernel, to interpolate each subcarrier is to interpolate their principal components, which are fewer.
    """

    def fit(self, known: KnownBand) -> None:
        responses = known.responses
        self._components = np.linalg.svd(responses.reshape(-1, responses.shape[2]), full_matrices=False)[2][:COMPONENTS]
        flat = (responses @ self._components.conj().T).reshape(len(responses), -1)
        self._shape = responses.shape[1], len(self._components)
        self._interpolator = Interpolator(known.positions, np.concatenate([flat.real, flat.imag], axis=1), known.seed)

    def predict(self, positions: Float[np.ndarray, "K 3"]) -> PredictedBand:
        values, deviation = self._interpolator.with_deviation(positions)
        real, imaginary = np.split(values, 2, axis=1)
        responses = (real + 1j * imaginary).reshape(len(positions), *self._shape) @ self._components
        kept = len(self._components) / self._components.shape[1]
        return PredictedBand(responses, np.sqrt(kept * np.square(deviation).mean(axis=1)))


class HelmholtzBand:
    """``BandField``: waves whose directions and delays are fitted."""

    found: str  # what the fit found, in words

    def fit(self, known: KnownBand) -> None:
        dataset = known.dataset
        region = np.stack([known.positions.min(axis=0), known.positions.max(axis=0)])
        self._field = BandField(region, dataset.beamformer, dataset.wavelength)
        self.found = self._field.fit(dataset, known.known)

    def predict(self, positions: Float[np.ndarray, "K 3"]) -> PredictedBand:
        return PredictedBand(*self._field.at(positions))
