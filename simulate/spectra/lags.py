"""The lags of an array, and whether an array with a grid can have measured some pictures.

The power S² of a spectrum is a sum of the array's lag functions (``fit_lags``), 49 of them for 4 × 4 elements. So
pictures p of power are such sums themselves, pictures of magnitude as (p + b)² with an offset b, and pictures in
decibels as 10^(pR/10) with the range R from black to white. What a least-squares fit leaves tells whether the array,
the grid and the scale are right: then only the rounding to 8 bits is left, 0.29 grey levels (root mean square).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache, lru_cache

import numpy as np
from jaxtyping import Complex, Float, Int

from scenes.files.errors import ParameterError, require_instance
from simulate.spectra.angular_grid import COLUMNS, ROWS, direction
from simulate.spectra.array import Array
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.spectrum import LARGEST_GREY, PictureScale, check_stack

VALUES_PER_FUNCTION = 8
"""Approximate number of pixels that the fit uses for each lag function. A 4 × 4 array has 49 lag functions."""

EXAMINED = 16
"""Number of spectra, evenly spread over a folder, from which the grid and the spacing are found."""

DEPENDENT = 1e-10
"""Relative size below which a lag function depends on the others, as those of an array that is small for a wavelength.
Then the smallest coefficients that fit are taken."""

LEAST_AMPLITUDE = 0.02
"""Smallest p + b by which an error of p² is divided to turn it into an error of p."""


MOST_FUNCTIONS = ROWS * COLUMNS // VALUES_PER_FUNCTION
"""Most lag functions of an array that pictures can be fitted with. An array of n elements at places without any
regularity has n (n − 1) + 1."""

SAME_LAG = 1e-4  # Wavelengths. Differences of positions that agree to this step are one lag.

RANGES = np.array([10.0, 15, 20, 25, 30, 35, 40, 50, 60])
"""Ranges from black to white to try for pictures in decibels. At larger ones few pixels count, and any array fits."""

WIDEST = 80.0  # Largest range of a single picture, for one with a deep null

RANGE_STEPS = 12
"""Steps by which the range of each picture is refined. Each divides the interval by 1.6."""

DB = np.log(10) / 10


@cache
def lag_vectors(array: Array) -> Float[np.ndarray, "L 3"]:
    """The lags Δ, different differences of two element positions, wavelengths; zero first, one of Δ and −Δ."""
    positions = array.positions
    first, second = np.triu_indices(len(positions), 1)
    lags = positions[first] - positions[second]
    # Positions in round numbers of wavelengths lie between two steps of a grid; they do not if it is shifted.
    shift = 0.1234
    z, y, x = np.rint(lags / SAME_LAG).T[::-1]
    lags = np.where(((z < 0) | ((z == 0) & ((y < 0) | ((y == 0) & (x < 0)))))[:, None], -lags, lags)
    steps = np.floor(lags / SAME_LAG + shift + 0.5)
    order = np.lexsort(steps.T)  # much faster than np.unique(axis=0)
    differs = np.diff(steps[order], axis=0, prepend=np.nan).any(axis=1)
    return np.concatenate([np.zeros((1, 3)), lags[order[differs]]])


def too_many_lags(array: Array, most: int = MOST_FUNCTIONS) -> str | None:
    """Why pictures cannot be fitted with an array: it has too many lag functions. None: they can."""
    functions = 2 * len(lag_vectors(array)) - 1
    if functions <= most:
        return None
    sums = f"the squared spectra of {array.in_words} are sums of {functions} functions"
    return f"{sums}, more than the {most} that can be fitted to pictures"


def lag_functions(
    array: Array, azimuth: Float[np.ndarray, " P"], elevation: Float[np.ndarray, " P"]
) -> Float[np.ndarray, "P F"]:
    """The real functions that add up to a squared spectrum: 1, and cos(k u·Δ) and sin(k u·Δ) for each lag Δ."""
    phase = 2 * np.pi * direction(azimuth, elevation) @ lag_vectors(array)[1:].T
    return np.concatenate([np.ones((len(phase), 1)), np.cos(phase), np.sin(phase)], axis=1)


@dataclass(frozen=True)
class LagSpace:
    """The lag functions of an array at some pixels of a grid: the space of the powers that the array can measure."""

    rows: Int[np.ndarray, " r"]  # the rows of these pixels
    columns: Int[np.ndarray, " c"]  # the columns of these pixels
    orthonormal: Float[np.ndarray, "P F"]  # an orthonormal basis of the space, [pixels, functions]
    triangular: Float[np.ndarray, "F F"]  # the lag functions in this basis, [functions, functions]

    @classmethod
    @lru_cache(maxsize=2)  # one array on one grid is tried for several quantities in turn
    def of(cls, beamformer: Beamformer) -> LagSpace:
        """The space of an array on a grid, at about ``VALUES_PER_FUNCTION`` pixels for each lag function."""
        array, grid = beamformer.array, beamformer.grid
        functions = 2 * len(lag_vectors(array)) - 1
        every = max(2, int(math.sqrt(ROWS * COLUMNS / (VALUES_PER_FUNCTION * functions))))
        rows, columns = np.arange(0, ROWS, every), np.arange(0, COLUMNS, every)
        elevation, azimuth = np.meshgrid(
            np.radians(grid.elevations_deg[rows]), np.radians(grid.azimuths_deg[columns]), indexing="ij"
        )
        return cls(rows, columns, *np.linalg.qr(lag_functions(array, azimuth.ravel(), elevation.ravel())))

    @property
    def freedom(self) -> int:
        """Number of pixels less that of the functions, since the fit absorbs a share of the errors."""
        pixels, functions = self.orthonormal.shape
        return pixels - functions

    def sampled(self, spectra: Float[np.ndarray, "K 90 360"]) -> Float[np.ndarray, "K P"]:
        return spectra[:, self.rows][:, :, self.columns].reshape(len(spectra), -1).astype(np.float64)

    def remainder(self, values: Float[np.ndarray, "K P"]) -> Float[np.ndarray, "K P"]:
        """What the lag functions leave of values at the pixels, by least squares."""
        return values - (values @ self.orthonormal) @ self.orthonormal.T

    def coefficients(self, values: Float[np.ndarray, "K P"]) -> Float[np.ndarray, "K F"]:
        """The factors of the lag functions that fit values at the pixels best."""
        projected = self.orthonormal.T @ values.T
        diagonal = np.abs(self.triangular.diagonal())
        if diagonal.min() < DEPENDENT * diagonal.max():
            return np.linalg.lstsq(self.triangular, projected, rcond=DEPENDENT)[0].T
        return np.linalg.solve(self.triangular, projected).T


@dataclass(frozen=True)
class LagFit:
    """How well an array with a grid explains K spectra.

    Attributes:
        beamformer: the array and the grid.
        lags: R_Δ for each of ``lag_vectors``, in units in which S = p + b; complex, [K, lags].
        offset: b, the ratio of each spectrum's minimum to its span before it was normalised, [K].
        residual: root mean square error of the fit to each spectrum, grey levels of 255, [K].
    """

    beamformer: Beamformer
    lags: Complex[np.ndarray, "K L"]
    offset: Float[np.ndarray, " K"]
    residual: Float[np.ndarray, " K"]

    @property
    def median_residual(self) -> float:
        """Median of the residuals, grey levels of 255."""
        return float(np.median(self.residual))


def fit_lags(spectra: Float[np.ndarray, "K 90 360"], beamformer: Beamformer) -> LagFit:
    """Fit the lags of an array to normalised spectra, to test whether this array and grid can have made them.

    The square of a magnitude spectrum S is a sum over the lags Δ, the differences of two element positions::

        S² = 1/MN Σ_Δ R_Δ e^{−jk u·Δ},   R_Δ = Σ_{m−n=Δ} y_m y_n*

    A normalised spectrum p equals S up to a scale and an offset b, so the fit finds b and the R_Δ by least squares. The
    residual is the evidence: the right array and grid leave about 0.3 grey levels, which is the rounding to 8 bits.
    """
    require_instance(Beamformer, beamformer=beamformer)
    spectra = check_stack("spectra", spectra)
    too_many = too_many_lags(beamformer.array)
    if too_many is not None:
        raise ParameterError("beamformer", f"expected an array of fewer lags: {too_many}")
    space = LagSpace.of(beamformer)
    values = space.sampled(spectra)
    # What remains after the least-squares fit of the lags. The only unknown left is b.
    square, linear = space.remainder(values**2), space.remainder(values)
    offset = np.maximum(-(square * linear).sum(axis=1) / (2 * np.maximum((linear**2).sum(axis=1), 1e-30)), 0)
    left = square + 2 * offset[:, None] * linear
    errors = LARGEST_GREY * left / (2 * np.maximum(values + offset[:, None], LEAST_AMPLITUDE))
    coefficients = space.coefficients(values**2 + 2 * offset[:, None] * values)
    count = coefficients.shape[1] // 2
    lags = np.empty((len(spectra), count + 1), complex)
    lags[:, 0] = coefficients[:, 0] + offset**2
    # R e^{-jx} + R* e^{jx} = 2 Re R cos x + 2 Im R sin x
    lags[:, 1:] = (coefficients[:, 1 : count + 1] + 1j * coefficients[:, count + 1 :]) / 2
    residual = np.sqrt((errors**2).sum(axis=1) / (space.freedom - 1))
    return LagFit(beamformer, beamformer.array.elements * lags, offset, residual)


def power_residual(space: LagSpace, spectra: Float[np.ndarray, "K 90 360"]) -> Float[np.ndarray, " K"]:
    """What an array leaves unexplained of spectra that would be powers: root mean square, grey levels."""
    left = space.remainder(space.sampled(spectra))
    return LARGEST_GREY * np.sqrt((left**2).sum(axis=1) / space.freedom)


def decibel_residual(
    space: LagSpace, spectra: Float[np.ndarray, "K 90 360"], steps: int = RANGE_STEPS
) -> tuple[Float[np.ndarray, " K"], Float[np.ndarray, " K"]]:
    """The same for spectra in decibels, and the range from black to white that leaves least of each, in decibels.

    Errors and slopes of power by grey level are averaged apart, so that the floor counts least.
    """
    values = space.sampled(spectra)

    def residual(decibels: Float[np.ndarray, " K"]) -> Float[np.ndarray, " K"]:
        power = 10 ** ((values - 1) * decibels[:, None] / 10)
        left = (space.remainder(power) ** 2).sum(axis=1) / space.freedom
        return LARGEST_GREY * np.sqrt(left / (power**2).mean(axis=1)) / (DB * decibels)

    tried = np.stack([residual(np.full(len(values), each)) for each in RANGES])
    best = tried.argmin(axis=0)
    if not steps:
        return tried.min(axis=0), RANGES[best]
    low, high = RANGES[np.maximum(best - 1, 0)], np.append(RANGES[1:], WIDEST)[best]
    golden = (5**0.5 - 1) / 2
    for _ in range(steps):  # golden-section search, all pictures at once
        left, right = high - golden * (high - low), low + golden * (high - low)
        lower = residual(left) < residual(right)
        low, high = np.where(lower, low, left), np.where(lower, right, high)
    decibels = (low + high) / 2
    return residual(decibels), decibels


def median_residual(
    spectra: Float[np.ndarray, "K 90 360"], beamformer: Beamformer, scale: PictureScale, steps: int = RANGE_STEPS
) -> float:
    """Median of the root mean square errors that an array leaves on spectra of a scale, grey levels."""
    if scale == "magnitude":
        return fit_lags(spectra, beamformer).median_residual
    space = LagSpace.of(beamformer)
    if scale == "power":
        return float(np.median(power_residual(space, spectra)))
    return float(np.median(decibel_residual(space, spectra, steps)[0]))
