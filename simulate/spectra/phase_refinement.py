"""Least squares for the responses behind spectra, from good starts, by the Gauss–Newton method.

The unknowns are the responses y and the offset b. The residual at a spatial frequency is |B y| − p − b with the beams
B y, and its derivative along δ is Re(e^{−j arg B y} B δ). So products with the Jacobian are Fourier transforms, and
conjugate gradients need no matrix.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy.fft
from jaxtyping import Bool, Complex, Float
from scipy.ndimage import map_coordinates

from simulate.spectra.angular_grid import COLUMNS, ROWS, AngularGrid
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.element_array import require_planar

STEPS, INNER_STEPS = 20, 30  # Largest number of steps, and steps of conjugate gradients for each

LEAST_GAIN = 0.02  # Share of its squared error that a step must save, or it is the spectrum's last

DAMPING = 1e-3  # Damping of the first step, as a share of the mean of the normal equations' diagonal

WRAPPED = 8  # Columns added on either side of a spectrum. A cubic spline forgets what is this far away.


@dataclass(frozen=True)
class SpatialFrequencies:
    """A grid of spatial frequencies for an array: ``shape`` frequencies over one period of its transform.

    With the spacing d in wavelengths, a direction u has the spatial frequencies (d u_x, d u_y). Beamforming is, up to a
    factor of magnitude 1, the Fourier transform of the responses. Visible frequencies lie in a disk of radius d.
    """

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
        """Magnitudes at the frequencies, by cubic splines of their smooth squares; 0 where not seen."""
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


@dataclass(frozen=True)
class _Linearised:
    """The residuals of some spectra at some unknowns, and their derivatives there."""

    frequencies: SpatialFrequencies  # the grid of spatial frequencies, of which P are seen
    error: Float[np.ndarray, "K P"]  # residuals |B y| − p − b, [K, P]
    phase: Complex[np.ndarray, "K P"]  # e^{j arg B y}, [K, P]

    @classmethod
    def at(
        cls, unknowns: Float[np.ndarray, "K n"], magnitude: Float[np.ndarray, "K P"], frequencies: SpatialFrequencies
    ) -> _Linearised:
        """At responses and offsets."""
        beams = _beams(unknowns, frequencies)
        size = np.abs(beams)
        return cls(frequencies, size - magnitude - unknowns[:, -1:], beams / np.maximum(size, 1e-12))

    def along(self, change: Float[np.ndarray, "K n"]) -> Float[np.ndarray, "K P"]:
        """Change of the residuals: the Jacobian times a change of the unknowns."""
        return (self.phase.conj() * _beams(change, self.frequencies)).real - change[:, -1:]

    def transposed(self, residuals: Float[np.ndarray, "K P"]) -> Float[np.ndarray, "K n"]:
        """The Jacobian's transpose times some residuals."""
        beams = np.zeros((len(residuals), *self.frequencies.shape), complex)
        beams[:, self.frequencies.seen] = self.phase * residuals
        # B is √(points / MN) times a matrix of orthonormal columns, and ``responses`` its inverse
        elements = self.frequencies.beamformer.array.elements
        back = self.frequencies.responses(beams).reshape(len(beams), -1) * (beams[0].size / elements)
        return np.concatenate([back.real, back.imag, -residuals.sum(axis=1, keepdims=True)], axis=1)

    def step(self, damping: Float[np.ndarray, " K"]) -> Float[np.ndarray, "K n"]:
        """The damped Gauss–Newton step, roughly."""

        def normal(change: np.ndarray) -> np.ndarray:
            return self.transposed(self.along(change)) + damping[:, None] * change

        return _conjugate_gradients(normal, self.transposed(-self.error))


def refined(
    start: Complex[np.ndarray, "K rows columns"],
    magnitude: Float[np.ndarray, "K y x"],
    frequencies: SpatialFrequencies,
) -> tuple[Complex[np.ndarray, "K elements"], Float[np.ndarray, " K"]]:
    """Responses and offsets of least squared error at the visible frequencies; a step that raises one is undone."""
    flat = start.reshape(len(start), -1).astype(complex)
    elements = flat.shape[1]
    unknowns = np.concatenate([flat.real, flat.imag, np.zeros((len(flat), 1))], axis=1)
    magnitude = magnitude[:, frequencies.seen]
    damping = np.full(len(flat), DAMPING * magnitude.shape[1] / elements)
    going = np.arange(len(flat))
    here = _Linearised.at(unknowns, magnitude, frequencies)
    for _ in range(STEPS):
        moved = unknowns[going] + here.step(damping[going])
        there = _Linearised.at(moved, magnitude[going], frequencies)
        before, after = ((each.error**2).sum(axis=1) for each in (here, there))
        lower = after < before
        unknowns[going[lower]] = moved[lower]
        damping[going] *= np.where(lower, 0.2, 4)
        error, phase = (
            np.where(lower[:, None], new, old) for new, old in ((there.error, here.error), (there.phase, here.phase))
        )
        gains = ~lower | (after < (1 - LEAST_GAIN) * before)
        going, here = going[gains], _Linearised(frequencies, error[gains], phase[gains])
        if not len(going):
            break
    return unknowns[:, :elements] + 1j * unknowns[:, elements:-1], unknowns[:, -1]


def _beams(unknowns: Float[np.ndarray, "K n"], frequencies: SpatialFrequencies) -> Complex[np.ndarray, "K P"]:
    """Beams of the responses among the unknowns at the visible frequencies."""
    array = require_planar(frequencies.beamformer.array, "phase retrieval")
    responses = unknowns[:, : array.elements] + 1j * unknowns[:, array.elements : -1]
    return frequencies.beams(responses.reshape(-1, array.rows, array.columns))[:, frequencies.seen]


def _conjugate_gradients(
    matrix: Callable[[Float[np.ndarray, "K n"]], Float[np.ndarray, "K n"]], right: Float[np.ndarray, "K n"]
) -> Float[np.ndarray, "K n"]:
    """Solve K symmetric positive systems roughly, by ``INNER_STEPS`` steps from zero."""
    solution, left, direction = np.zeros_like(right), right, right
    power = (left**2).sum(axis=1)
    for _ in range(INNER_STEPS):
        image = matrix(direction)
        step = (power / np.maximum((direction * image).sum(axis=1), 1e-300))[:, None]
        solution, left = solution + step * direction, left - step * image
        new_power = (left**2).sum(axis=1)
        direction = left + (new_power / np.maximum(power, 1e-300))[:, None] * direction
        power = new_power
    return solution
