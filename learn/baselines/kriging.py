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

from simulate.spectra.angular_grid import COLUMNS, ROWS
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.compiled_beamformer import compiled_beamformer
from simulate.spectra.spectrum import normalise

COMPONENTS = 48  # number of principal components of the spectra that are interpolated
FITTED_ON = 400  # largest number of spectra to which the kernel's parameters are fitted; predictions use all spectra


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
        normalised_values = self._process.predict(positions).reshape(len(positions), -1)
        return normalised_values * self._scale + self._mean

    def with_deviation(
        self, positions: Float[np.ndarray, "K 3"]
    ) -> tuple[Float[np.ndarray, "K outputs"], Float[np.ndarray, "K outputs"]]:
        """Interpolated values at positions in metres, and their standard deviations, noise included."""
        mean, deviation = (each.reshape(len(positions), -1) for each in self._process.predict(positions, True))
        return mean * self._scale + self._mean, np.broadcast_to(deviation * self._scale, mean.shape)


def krige_spectra(
    positions: Float[np.ndarray, "n 3"], spectra: Float[np.ndarray, "n 90 360"], seed: int
) -> Callable[[Float[np.ndarray, "K 3"]], Float[np.ndarray, "K 90 360"]]:
    """Interpolate the principal components of known spectra."""
    pixels = spectra.reshape(len(spectra), -1)
    with np.errstate(invalid="ignore"):  # PCA divides 0 by 0 if all spectra are the same
        components = PCA(min(COMPONENTS, len(pixels)), random_state=seed).fit(pixels)
    interpolator = Interpolator(positions, components.transform(pixels), seed)

    def predict(new_positions: Float[np.ndarray, "K 3"]) -> Float[np.ndarray, "K 90 360"]:
        new_pixels = components.inverse_transform(interpolator(new_positions))
        return new_pixels.reshape(len(new_positions), *spectra.shape[1:])

    return predict


def krige_responses(
    positions: Float[np.ndarray, "n 3"], responses: Complex[np.ndarray, "n elements"], beamformer: Beamformer, seed: int
) -> Callable[[Float[np.ndarray, "K 3"]], Float[np.ndarray, "K 90 360"]]:
    """Interpolate known element responses."""
    quick = compiled_beamformer(beamformer)
    interpolator = Interpolator(positions, np.concatenate([responses.real, responses.imag], axis=1), seed)

    def predict(new_positions: Float[np.ndarray, "K 3"]) -> Float[np.ndarray, "K 90 360"]:
        real, imaginary = np.split(interpolator(new_positions), 2, axis=1)
        interpolated = real + 1j * imaginary
        if quick is None:
            return normalise(beamformer.spectrum(interpolated))
        spectra = np.empty((len(interpolated), ROWS, COLUMNS), np.float32)
        quick.write(interpolated, spectra)
        return spectra

    return predict
