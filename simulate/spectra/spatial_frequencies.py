"""Spectra on a grid of spatial frequencies, where beamforming is a discrete Fourier transform.

With the spacing d in wavelengths, a direction u has the spatial frequencies (d u_x, d u_y), and the beamformer

    Σ_m y_m e^{−jk u·d_m}

is, up to a factor of magnitude 1, the Fourier transform of the responses y over rows and columns of the array. On a
grid of frequencies it costs an FFT. The visible frequencies, those of a direction, lie in a disk of radius d.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy.fft
from jaxtyping import Bool, Complex, Float
from scipy.ndimage import map_coordinates

from simulate.spectra.angular_grid import COLUMNS, ROWS, AngularGrid
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.element_array import require_planar

WRAPPED = 8
"""Columns added on either side of a spectrum. A cubic spline forgets what is this far away."""


@dataclass(frozen=True)
class SpatialFrequencies:
    """A grid of spatial frequencies for an array: ``shape`` frequencies over one period of its transform."""

    beamformer: Beamformer  # the array, and the angular grid of its spectra
    shape: tuple[int, int]  # number of frequencies along y and along x
    seen: Bool[np.ndarray, "y x"]  # whether a frequency belongs to a direction within the angular grid, [*shape]
    row: Float[np.ndarray, "y x"]  # row of this direction in a spectrum, a fraction, [*shape]
    column: Float[np.ndarray, "y x"]  # its column, a fraction, [*shape]

    @classmethod
    def of(cls, beamformer: Beamformer, oversampling: int, least: int = 1) -> SpatialFrequencies:
        """The grid with ``oversampling`` frequencies for each row and column of the array."""
        array, grid = require_planar(beamformer.array, "a grid of spatial frequencies"), beamformer.grid
        shape = (max(least, oversampling * array.rows), max(least, oversampling * array.columns))
        y, x = (scipy.fft.fftfreq(count) / array.spacing for count in shape)
        u_x, u_y = np.meshgrid(x, y)
        across = np.hypot(u_x, u_y)  # the cosine of the elevation
        elevation = np.degrees(np.arccos(np.minimum(across, 1)))
        row = (elevation - grid.elevation_first_deg) / grid.elevation_step_deg
        column = np.degrees(np.arctan2(u_y, u_x)) % 360 / grid.azimuth_step_deg
        last = COLUMNS if _is_full_circle(grid) else COLUMNS - 1
        seen = (across <= 1) & (row >= 0) & (row <= ROWS - 1) & (column <= last)
        return cls(beamformer, shape, seen, row, column)

    def sampled(self, spectra: Float[np.ndarray, "K 90 360"]) -> Float[np.ndarray, "K y x"]:
        """Magnitude spectra at the frequencies, by cubic splines; 0 where a frequency is not seen.

        The splines are those of the squared magnitudes, which are smooth at the zeros of a spectrum.
        """
        where = [self.row[self.seen], self.column[self.seen] + WRAPPED]
        beside: Literal["wrap", "edge"] = "wrap" if _is_full_circle(self.beamformer.grid) else "edge"
        sampled = np.zeros((len(spectra), *self.shape))
        for each, spectrum in zip(sampled, spectra, strict=True):
            periodic = np.pad(np.square(spectrum, dtype=np.float64), ((0, 0), (WRAPPED, WRAPPED)), mode=beside)
            each[self.seen] = np.sqrt(np.maximum(map_coordinates(periodic, where, mode="nearest"), 0))
        return sampled

    def beams(self, responses: Complex[np.ndarray, "K rows columns"]) -> Complex[np.ndarray, "K y x"]:
        """Beams of element responses at the frequencies, as ``Beamformer.spectrum`` has them before the magnitude."""
        return scipy.fft.fft2(responses, s=self.shape) * self.beamformer.array.elements**-0.5

    def responses(self, beams: Complex[np.ndarray, "K y x"]) -> Complex[np.ndarray, "K rows columns"]:
        """The responses whose beams are nearest to some beams at all frequencies, seen or not (least squares)."""
        array = require_planar(self.beamformer.array, "a grid of spatial frequencies")
        whole = scipy.fft.ifft2(beams)[:, : array.rows, : array.columns]
        return whole * array.elements**0.5


def _is_full_circle(grid: AngularGrid) -> bool:
    """Whether column 0 follows the last column."""
    return COLUMNS * grid.azimuth_step_deg == 360
