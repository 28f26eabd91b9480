"""A few pixels of a spectrum whose weighted mean equals the mean over all pixels.

The product of two squared spectra is a sum of plane waves e^{-jk u·Δ}, whose Δ are sums of two lags.

- Along azimuth, their mean over W equally spaced φ is wrong by at most about 2 J_W(κ), with κ = 2π |Δ| in wavelengths.
- Along elevation, the weights of the rows solve Σ_θ w_θ J₀(κ_Δ cosθ) = mean_θ J₀(κ_Δ cosθ) for all Δ.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int
from pytorch_msssim import ssim as gaussian_ssim
from scipy.interpolate import CubicSpline
from scipy.special import j0, jv
from torch import Tensor

from simulate.spectra.angular_grid import COLUMNS, ROWS
from simulate.spectra.array import Array, PlanarArray
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.element_array import uniform
from simulate.spectra.lags import lag_vectors

WRONG_ALONG_AZIMUTH, WRONG_ALONG_ELEVATION = 1e-6, 1e-9  # largest errors of the mean of one plane wave

LEAST_WEIGHT = 0.9
"""Smallest weight of a row relative to equal weights; with less, errors in that row would hardly count."""


MOST_LAGS, MOST_BANDS = 200, 500
"""Lags of an array at given positions, and different sums of two of them, up to which all are listed."""

PER_WAVELENGTH, SAME_BAND = 4, 1e-4
"""Sums for each wavelength that stand for all others, and wavelengths up to which two of them are the same."""


@dataclass(frozen=True)
class Quadrature:
    """Pixels of a spectrum: all pairs of some rows and some columns."""

    rows: Int[np.ndarray, " H"]  # [H] rows of the picture
    columns: Int[np.ndarray, " W"]  # [W] columns of the picture, equally spaced
    weights: Float[np.ndarray, " H"]  # [H] weight of each row's mean; the weights add up to 1

    def __len__(self) -> int:
        return len(self.rows) * len(self.columns)


def quadrature(beamformer: Beamformer) -> Quadrature:
    """The fewest rows and columns that hold the band of an array; 18 × 45 for the default one."""
    bands, heights = _bands(beamformer.array)
    divisors = [width for width in range(1, COLUMNS + 1) if COLUMNS % width == 0 and width > bands.max()]
    width = next((each for each in divisors if 2 * abs(jv(each, bands.max())) < WRONG_ALONG_AZIMUTH), COLUMNS)
    if abs(beamformer.grid.azimuth_step_deg) * COLUMNS != 360:  # the columns do not make a full turn
        width = COLUMNS
    elevation = np.radians(beamformer.grid.elevations_deg)[:, None]
    waves = j0(bands * np.cos(elevation))
    if heights.any():  # lags with a part along the boresight
        phase = heights * np.sin(elevation)
        waves = np.concatenate([waves * np.cos(phase), waves * np.sin(phase)], axis=1)
    least = 1 if uniform(beamformer.array) is not None or len(bands) <= MOST_BANDS else ROWS
    for height in range(least, ROWS):
        chosen = np.round((np.arange(height) + 0.5) * ROWS / height - 0.5).astype(int)
        # The solution that is closest to equal weights.
        change, *_ = np.linalg.lstsq(waves[chosen].T, waves.mean(axis=0) - waves[chosen].mean(axis=0), rcond=1e-12)
        weights = 1 / height + change
        error = np.abs(weights @ waves[chosen] - waves.mean(axis=0)).max()
        if error < WRONG_ALONG_ELEVATION and weights.min() > LEAST_WEIGHT / height:
            break
    else:
        chosen, weights = np.arange(ROWS), np.full(ROWS, 1 / ROWS)
    return Quadrature(chosen, np.arange(0, COLUMNS, COLUMNS // width), weights)


def _bands(array: Array) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, " n"]]:
    """The different sums of two lags, times 2π: their length across the boresight and their part along it."""
    planar = uniform(array)
    if planar is not None:
        rows, columns = np.meshgrid(np.arange(2 * planar.rows - 1), np.arange(2 * planar.columns - 1))
        bands = 2 * np.pi * planar.spacing * np.unique(np.hypot(rows, columns).round(9))
        return bands, np.zeros_like(bands)
    lags = lag_vectors(array)
    if len(lags) <= MOST_LAGS:
        both = np.concatenate([lags, -lags[1:]])
        sums = (both[:, None] + lags).reshape(-1, 3)  # the others are these with the other sign
        pairs = np.stack([np.hypot(sums[:, 0], sums[:, 1]), np.abs(sums[:, 2])], axis=1)
        pairs = pairs[np.unique((pairs / SAME_BAND).round(), axis=0, return_index=True)[1]]
        if len(pairs) <= MOST_BANDS:
            return tuple(2 * np.pi * pairs.T)
    # Too many to list. Between them the means are smooth, so that a few for each wavelength stand for all.
    across, along = 2 * np.hypot(lags[:, 0], lags[:, 1]).max(), 2 * np.abs(lags[:, 2]).max()
    wide, high = (np.linspace(0, each, max(2, math.ceil(each * PER_WAVELENGTH))) for each in (across, along))
    grid = np.meshgrid(wide, high if along else [0.0], indexing="ij")
    return 2 * np.pi * grid[0].ravel(), 2 * np.pi * grid[1].ravel()


def picture_pixels(beamformer: Beamformer) -> Quadrature:
    """Pixels from which a spectrum is interpolated: at least those of a 4 × 4 array, for sharp valleys."""
    own, larger = quadrature(beamformer), quadrature(replace(beamformer, array=PlanarArray()))
    by_rows = max(own, larger, key=lambda pixels: len(pixels.rows))
    by_columns = max(own, larger, key=lambda pixels: len(pixels.columns))
    return Quadrature(by_rows.rows, by_columns.columns, by_rows.weights)


def interpolation(pixels: Quadrature) -> tuple[Float[np.ndarray, "90 H"], Float[np.ndarray, "360 W"]]:
    """Matrices R and C that turn pixels x into a picture R x Cᵀ by cubic splines, periodic along azimuth."""
    rows = np.ones((ROWS, 1))
    if len(pixels.rows) > 1:
        rows = CubicSpline(pixels.rows, np.eye(len(pixels.rows)))(np.arange(ROWS))
    turn = np.vstack([np.eye(len(pixels.columns)), np.eye(len(pixels.columns))[:1]])
    columns = CubicSpline([*pixels.columns, COLUMNS], turn, bc_type="periodic")(np.arange(COLUMNS))
    return rows, columns


L1_WEIGHT, SSIM_WEIGHT = 0.7, 0.3  # weights of the two terms in the paper
WINDOW, SIGMA = 5, 1.0  # size and standard deviation of the SSIM's Gaussian window at a few pixels


def composite_loss(
    prediction: Float[Tensor, "B 90 360"], truth: Float[Tensor, "B 90 360"], ssim_weight: float = SSIM_WEIGHT
) -> Float[Tensor, ""]:
    """0.7 L1 + 0.3 (1 − SSIM), averaged over the batch; a Gaussian window is separable, and so ten times faster."""
    # The batch is passed as one image with B colour planes. The mean is the same, and the convolutions are several
    # times faster.
    similarity = gaussian_ssim(prediction[None], truth[None], data_range=1.0)
    return (1 - ssim_weight) * (prediction - truth).abs().mean() + ssim_weight * (1 - similarity)


def coarse_loss(
    prediction: Float[Tensor, "B H W"], truth: Float[Tensor, "B H W"], pixels: Quadrature
) -> Float[Tensor, ""]:
    """The composite loss at a few pixels: L1 weighted as the mean over all, and the SSIM of the coarser picture."""
    rows = (prediction - truth).abs().mean(dim=(0, 2))
    similarity = gaussian_ssim(prediction[None], truth[None], data_range=1.0, win_size=WINDOW, win_sigma=SIGMA)
    return L1_WEIGHT * rows @ rows.new_tensor(pixels.weights) + SSIM_WEIGHT * (1 - similarity)
