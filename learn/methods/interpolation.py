"""The mean, neighbours and kriging of any quantity: known values as flat real numbers, predicted, and put together."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
from jaxtyping import Float, Num
from sklearn.decomposition import PCA
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

from learn.data.neighbours import inverse_distance, nearest
from learn.models.capabilities import no_comparable_phases
from learn.models.kriging.deviation_curve import NORMAL
from learn.quantities.known import Known
from learn.quantities.quantity import Prediction
from simulate.dataset.dataset import Dataset
from simulate.spectra.angular_grid import COLUMNS, ROWS
from simulate.spectra.compiled_beamformer import compiled_beamformer
from simulate.spectra.spectrum import normalise

COMPONENTS = 48  # Most principal components of the values that are interpolated

FITTED_ON = 400  # Most values to which the kernel's parameters are fitted; predictions use all values


def _whole(known: Known) -> Num[np.ndarray, "n ..."]:
    """The known values without gaps: where a power was not received, what its law expects below the floor."""
    return known.quantity.whole(known.dataset, known.rows)


class Mean:
    """The mean of the known values."""

    def fit(self, known: Known) -> None:
        self._positions, self._values = known.positions, _whole(known)

    def predict(self, positions: Float[np.ndarray, "K 3"], given: Any = None) -> Prediction:
        mean = self._values.mean(axis=0)
        return Prediction(np.broadcast_to(mean, (len(positions), *mean.shape)))


class Nearest(Mean):
    """A copy of the value at the nearest known position."""

    def predict(self, positions: Float[np.ndarray, "K 3"], given: Any = None) -> Prediction:
        return Prediction(nearest(self._positions, self._values, positions))


class InverseDistance(Mean):
    """The mean of the values at the four nearest known positions, weighted by 1 / distance."""

    def predict(self, positions: Float[np.ndarray, "K 3"], given: Any = None) -> Prediction:
        return Prediction(inverse_distance(self._positions, self._values, positions))


class Interpolator:
    """Gaussian process with one squared-exponential kernel for all outputs.

    The parameters of the kernel (variance, length, noise) maximise the marginal likelihood.
    """

    def __init__(self, positions: Float[np.ndarray, "n 3"], values: Float[np.ndarray, "n outputs"], seed: int):
        spacing = max(np.ptp(positions, axis=0).max(), 1e-3) / 10  # all positions may be the same
        kernel = ConstantKernel(1.0) * RBF(spacing, (spacing / 30, spacing * 30)) + WhiteKernel(0.01, (1e-6, 1.0))
        self._mean, self._scale = values.mean(axis=0), values.std() + 1e-12
        normalised_values = (values - self._mean) / self._scale
        fitted_on = np.random.default_rng(seed).permutation(len(positions))[:FITTED_ON]
        process = GaussianProcessRegressor(kernel, random_state=seed)
        with warnings.catch_warnings():
            # A length or noise at the end of its interval means a poor fit, but can still be used.
            warnings.simplefilter("ignore", ConvergenceWarning)
            process.fit(positions[fitted_on], normalised_values[fitted_on])
        self._process = GaussianProcessRegressor(process.kernel_, optimizer=None).fit(positions, normalised_values)

    def __call__(self, positions: Float[np.ndarray, "K 3"]) -> Float[np.ndarray, "K outputs"]:
        """Interpolated values at positions in metres."""
        return self._process.predict(positions).reshape(len(positions), -1) * self._scale + self._mean

    def with_deviation(
        self, positions: Float[np.ndarray, "K 3"]
    ) -> tuple[Float[np.ndarray, "K outputs"], Float[np.ndarray, " K"]]:
        """The same, and their standard deviation, noise included, which takes longer."""
        mean, deviation = (each.reshape(len(positions), -1) for each in self._process.predict(positions, True))
        return mean * self._scale + self._mean, deviation[:, 0] * self._scale


class Kriging:
    """Gaussian-process interpolation (kriging) of principal components, about the quantity's trend if it has one.

    With one kernel for all, to interpolate each number is to interpolate their components, which are fewer.
    """

    def fit(self, known: Known) -> None:
        values = _whole(known)
        self._complex, self._shape = np.iscomplexobj(values), values.shape[1:]
        self._states_intervals = known.quantity.states_intervals
        self._trend: Callable | None = known.quantity.trend(known.dataset, known.rows)
        if self._trend is not None:
            values = values - self._trend(known.positions)
        flat = values.reshape(len(values), -1)
        if self._complex:
            flat = np.concatenate([flat.real, flat.imag], axis=1)
        self._components = None
        if flat.shape[1] > COMPONENTS:
            with np.errstate(invalid="ignore"):  # PCA divides 0 by 0 if all values are the same
                self._components = PCA(min(COMPONENTS, len(flat)), random_state=known.seed).fit(flat)
            flat = self._components.transform(flat)
        self._interpolator = Interpolator(known.positions, flat, known.seed)

    def predict(self, positions: Float[np.ndarray, "K 3"], given: Any = None) -> Prediction:
        if not self._states_intervals:
            return Prediction(self._whole(self._interpolator(positions), positions))
        flat, deviation = self._interpolator.with_deviation(positions)
        value = self._whole(flat, positions)
        if self._components is not None:
            kept = self._components.components_
            deviation = deviation * np.sqrt(len(kept) / kept.shape[1])
        if self._complex:
            return Prediction(value, deviation=deviation)
        half = NORMAL * deviation.reshape(-1, *[1] * len(self._shape))
        return Prediction(value, value - half, value + half)

    def _whole(self, flat: Float[np.ndarray, "K outputs"], positions: Float[np.ndarray, "K 3"]) -> np.ndarray:
        """Values of the quantity from interpolated numbers."""
        if self._components is not None:
            flat = self._components.inverse_transform(flat)
        if self._complex:
            real, imaginary = np.split(flat, 2, axis=1)
            flat = real + 1j * imaginary
        value = flat.reshape(len(positions), *self._shape)
        return value if self._trend is None else value + self._trend(positions)


class KrigingResponses:
    """Kriging of the recorded element responses, whose spectra are predicted."""

    @staticmethod
    def unsuited(dataset: Dataset) -> str | None:
        """Why a dataset has no responses to interpolate, for the user. None: it has."""
        return no_comparable_phases(dataset) if "response" not in dataset.values else None

    def fit(self, known: Known) -> None:
        responses = known.dataset.responses[known.rows]
        self._beamformer = known.dataset.beamformer
        flat = np.concatenate([responses.real, responses.imag], axis=1)
        self._interpolator = Interpolator(known.positions, flat, known.seed)

    def predict(self, positions: Float[np.ndarray, "K 3"], given: Any = None) -> Prediction:
        real, imaginary = np.split(self._interpolator(positions), 2, axis=1)
        quick = compiled_beamformer(self._beamformer)
        if quick is None:
            return Prediction(normalise(self._beamformer.spectrum(real + 1j * imaginary)))
        spectra = np.empty((len(positions), ROWS, COLUMNS), np.float32)
        quick.write(real + 1j * imaginary, spectra)
        return Prediction(spectra)
