"""Gaussian-process interpolation (kriging) of spectra, and of element responses, without any physics."""

from __future__ import annotations

import warnings
from collections.abc import Callable

import numpy as np
from jaxtyping import Complex, Float
from sklearn.decomposition import PCA
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

from simulate.array import PlanarArray
from simulate.spectrum import normalise

COMPONENTS = 48
"""Number of principal components of the spectra that are interpolated."""

FITTED_ON = 400
"""Spectra that the kernel's length and noise are fitted on; all are used to predict."""


class Interpolator:
    """Gaussian process with one squared-exponential kernel for all outputs, its parameters by marginal likelihood."""

    def __init__(self, positions: Float[np.ndarray, "n 3"], values: Float[np.ndarray, "n outputs"], seed: int):
        spacing = np.ptp(positions, axis=0).max() / 10
        kernel = ConstantKernel(1.0) * RBF(spacing, (spacing / 30, spacing * 30)) + WhiteKernel(0.01, (1e-6, 1.0))
        self._mean, self._scale = values.mean(axis=0), values.std() + 1e-12
        wanted = (values - self._mean) / self._scale
        some = np.random.default_rng(seed).permutation(len(positions))[:FITTED_ON]
        process = GaussianProcessRegressor(kernel, random_state=seed)
        with warnings.catch_warnings():
            # A length or a noise at the bound of its interval is a fit, if a poor one.
            warnings.simplefilter("ignore", ConvergenceWarning)
            process.fit(positions[some], wanted[some])
        self._process = GaussianProcessRegressor(process.kernel_, optimizer=None).fit(positions, wanted)

    def __call__(self, positions: Float[np.ndarray, "K 3"]) -> Float[np.ndarray, "K outputs"]:
        found = self._process.predict(positions).reshape(len(positions), -1)
        return found * self._scale + self._mean


def krige_spectra(
    positions: Float[np.ndarray, "n 3"], spectra: Float[np.ndarray, "n 90 360"], seed: int
) -> Callable[[Float[np.ndarray, "K 3"]], Float[np.ndarray, "K 90 360"]]:
    """Fit the principal components of known spectra; returns a function that interpolates at other positions."""
    pixels = spectra.reshape(len(spectra), -1)
    components = PCA(min(COMPONENTS, len(pixels)), random_state=seed).fit(pixels)
    interpolator = Interpolator(positions, components.transform(pixels), seed)
    return lambda asked: components.inverse_transform(interpolator(asked)).reshape(len(asked), *spectra.shape[1:])


def krige_responses(
    positions: Float[np.ndarray, "n 3"], responses: Complex[np.ndarray, "n elements"], array: PlanarArray, seed: int
) -> Callable[[Float[np.ndarray, "K 3"]], Float[np.ndarray, "K 90 360"]]:
    """Fit known element responses; returns a function that interpolates them and beamforms spectra from them."""
    interpolator = Interpolator(positions, np.concatenate([responses.real, responses.imag], axis=1), seed)

    def predict(asked: Float[np.ndarray, "K 3"]) -> Float[np.ndarray, "K 90 360"]:
        real, imaginary = np.split(interpolator(asked), 2, axis=1)
        return normalise(array.spectrum(real + 1j * imaginary))

    return predict
