"""The lags of an array, and which array and angular grid a folder of spectra was made with.

The square of a magnitude spectrum is a sum over the differences (lags) Δ of two element positions,

    S(φ,θ)² = 1/MN Σ_Δ R_Δ e^{-jk u·Δ},   R_Δ = Σ_{m−n=Δ} y_m y_n*,   R_{−Δ} = R_Δ*,

so that an M × N array can only measure a space of (2M−1)(2N−1) dimensions: 49 for 4 × 4. A min–max normalised spectrum
p is S up to a scale and an offset, S ∝ p + b with b ≥ 0, and p² + 2bp + b² is linear in the R_Δ. A least-squares fit of
p² by the lag functions and p tells whether an array with a given grid can have measured p: of the right one only the
rounding to 8 bits is left, 0.29 grey levels (root mean square).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Complex, Float, Int
from scipy.optimize import minimize_scalar

from simulate.angular_grid import AngularGrid, direction
from simulate.array import PlanarArray
from simulate.spectrum import LARGEST_GREY

EVERY_ROW, EVERY_COLUMN = 5, 9
"""The fit looks at every fifth row and ninth column: 720 values, where a 4 × 4 array has 49 degrees of freedom."""

EXAMINED = 16
"""Number of spectra, evenly spread over a folder, that the grid and the spacing are found from."""

SPACINGS = np.arange(0.30, 0.71, 0.01)
"""Spacings that are tried first, wavelengths."""

FIRST_ELEVATIONS = 0.0, 1.0
"""Elevations of row 0 that are tried, degrees: NeRF²'s measured pictures begin at the horizon, others at 1°."""

LEAST_AMPLITUDE = 0.02
"""Smallest p + b by which an error of p² is divided to make it an error of p."""


def lag_vectors(array: PlanarArray) -> Int[np.ndarray, "L 2"]:
    """The lags Δ of an array in units of its spacing, (column, row); of Δ and −Δ only one, zero first.

    >>> lag_vectors(PlanarArray()).shape
    (25, 2)
    """
    rows, columns = np.meshgrid(np.arange(array.rows), np.arange(1 - array.columns, array.columns), indexing="ij")
    lags = np.stack([columns.ravel(), rows.ravel()], axis=-1)
    return np.concatenate([[[0, 0]], lags[(lags[:, 1] > 0) | (lags[:, 0] > 0)]])


def lag_functions(
    array: PlanarArray, azimuth: Float[np.ndarray, " P"], elevation: Float[np.ndarray, " P"]
) -> Float[np.ndarray, "P F"]:
    """The real functions that squared spectra are sums of: 1, cos(k u·Δ), sin(k u·Δ) for each lag Δ.

    Args:
        array: the array.
        azimuth: φ in radians.
        elevation: θ in radians.
    """
    phase = 2 * np.pi * array.spacing * direction(azimuth, elevation)[:, :2] @ lag_vectors(array)[1:].T
    return np.concatenate([np.ones((len(phase), 1)), np.cos(phase), np.sin(phase)], axis=1)


@dataclass(frozen=True)
class LagFit:
    """How well an array with a grid explains K spectra.

    Attributes:
        array: the array.
        grid: the grid.
        lags: R_Δ for each of ``lag_vectors``, in units in which S = p + b.
        offset: b, the smallest magnitude of each spectrum over its span before it was normalised.
        residual: root mean square error of each spectrum, grey levels of 255.
    """

    array: PlanarArray
    grid: AngularGrid
    lags: Complex[np.ndarray, "K L"]
    offset: Float[np.ndarray, " K"]
    residual: Float[np.ndarray, " K"]


def fit_lags(spectra: Float[np.ndarray, "K 90 360"], array: PlanarArray, grid: AngularGrid) -> LagFit:
    """Fit the lags of an array to normalised spectra.

    Args:
        spectra: min–max normalised spectra, 0…1.
        array: the array to try.
        grid: the grid to try.

    >>> array, grid = PlanarArray(), AngularGrid(elevation_first_deg=1.0)
    >>> spectrum = array.spectrum(np.random.default_rng(0).standard_normal((1, 16, 2)) @ [1, 1j])
    >>> from simulate.spectrum import normalise
    >>> bool(fit_lags(normalise(spectrum), array, grid).residual[0] < 1e-6)
    True
    """
    rows, columns = np.arange(0, 90, EVERY_ROW), np.arange(0, 360, EVERY_COLUMN)
    elevation, azimuth = np.meshgrid(
        np.radians(grid.elevations_deg[rows]), np.radians(grid.azimuths_deg[columns]), indexing="ij"
    )
    functions = lag_functions(array, azimuth.ravel(), elevation.ravel())
    values = spectra[:, rows][:, :, columns].reshape(len(spectra), -1).astype(np.float64)
    orthonormal, triangular = np.linalg.qr(functions)

    def remainder(x: np.ndarray) -> np.ndarray:
        return x - (x @ orthonormal) @ orthonormal.T

    # Least squares over the lags leave these; b then follows from a single unknown.
    square, linear = remainder(values**2), remainder(values)
    offset = np.maximum(-(square * linear).sum(axis=1) / (2 * np.maximum((linear**2).sum(axis=1), 1e-30)), 0)
    left = square + 2 * offset[:, None] * linear
    errors = LARGEST_GREY * left / (2 * np.maximum(values + offset[:, None], LEAST_AMPLITUDE))
    coefficients = np.linalg.solve(triangular, orthonormal.T @ (values**2 + 2 * offset[:, None] * values).T).T
    count = len(lag_vectors(array)) - 1
    lags = np.empty((len(spectra), count + 1), complex)
    lags[:, 0] = coefficients[:, 0] + offset**2
    # R e^{-jx} + R* e^{jx} = 2 Re R cos x + 2 Im R sin x
    lags[:, 1:] = (coefficients[:, 1 : count + 1] + 1j * coefficients[:, count + 1 :]) / 2
    return LagFit(array, grid, array.elements * lags, offset, np.sqrt((errors**2).mean(axis=1)))


def find_grid(spectra: Float[np.ndarray, "K 90 360"], rows: int = 4, columns: int = 4) -> LagFit:
    """Find the spacing and the first elevation that explain a folder's spectra best, from a few of them, in seconds.

    Args:
        spectra: min–max normalised spectra, 0…1.
        rows: number of the array's elements along y.
        columns: number of the array's elements along x.

    Returns:
        The best fit, to the spectra that were examined.
    """
    examined = spectra[np.unique(np.linspace(0, len(spectra) - 1, min(EXAMINED, len(spectra))).astype(int))]

    def median_residual(spacing: float, grid: AngularGrid) -> float:
        return float(np.median(fit_lags(examined, PlanarArray(rows, columns, float(spacing)), grid).residual))

    best = None
    for first in FIRST_ELEVATIONS:
        grid = replace(AngularGrid(), elevation_first_deg=first)
        coarse = SPACINGS[np.argmin([median_residual(spacing, grid) for spacing in SPACINGS])]
        found = minimize_scalar(
            median_residual,
            args=(grid,),
            bounds=(coarse - 0.01, coarse + 0.01),
            method="bounded",
            options={"xatol": 1e-4},
        )
        if best is None or found.fun < best[0]:
            best = found.fun, found.x, grid
    assert best is not None
    return fit_lags(examined, PlanarArray(rows, columns, float(best[1])), best[2])
