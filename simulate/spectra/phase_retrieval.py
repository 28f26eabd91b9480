"""The element responses behind a spectrum, found by phase retrieval.

Known of the beams at spatial frequencies are their magnitudes where the hemisphere shows them, and that they are those
of M × N responses. Relaxed reflect-reflect (RRR) [elser2018] searches for beams that fulfil both, from random starts.
The Gauss–Newton method then finds the responses of least squared error nearby.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.fft
from jaxtyping import Bool, Complex, Float, Float32, Int

from scenes.files.errors import require_instance, require_seed
from simulate.spectra.angular_grid import COLUMNS, ROWS
from simulate.spectra.array import PlanarArray
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.element_array import require_planar
from simulate.spectra.phase_refinement import refined
from simulate.spectra.spectrum import LARGEST_GREY, check_stack

GOOD = 0.5  # Grey levels. A spectrum is done when its root mean square error is smaller than this.

OVERSAMPLING = 4  # Spatial frequencies of the search for each element along an axis

STEPS_PER_ELEMENT, MOST_STEPS = 60, 15_360
"""Steps of a search for each element along the longer axis, and largest number of steps in all searches: 64 random
starts for 4 × 4 elements, 16 for 16 × 16."""

RELAXATION = 0.3, 1.5
"""Range from which each start draws the factor β. Spectra that are not found with one are found with another."""

SETTLING_STEPS = 20  # Plain projections after the search, which lead to the bottom of the valley

DIRECTIONS, DIRECTIONS_PER_ELEMENT = 700, 12
"""Least number of pixels, evenly spread over the hemisphere, at which the error is made small, and that for each
element."""

AT_ONCE = 100  # Spectra per batch. This bounds the memory.


@dataclass(frozen=True)
class Retrieval:
    """Responses retrieved from K spectra.

    Attributes:
        responses: complex element responses, up to a common phase and the flip, [K, elements]; in units in which the
            spectrum's span is 1.
        residual: root mean square error of the spectrum that these responses make, grey levels of 255, [K]. Above
            ``GOOD`` (0.5) the retrieval is doubtful.
    """

    responses: Complex[np.ndarray, "K elements"]
    residual: Float[np.ndarray, " K"]


def retrieve_responses(spectra: Float[np.ndarray, "K 90 360"], beamformer: Beamformer, seed: int = 0) -> Retrieval:
    """Find the complex element responses behind normalised spectra (phase retrieval).

    A magnitude spectrum determines the responses y of a planar array up to a common phase and the flip
    ``y_m -> conj(y_{MN−1−m})`` [hayes1982]. So the responses of one spectrum can be used, but phases of two spectra
    cannot be compared. Relaxed reflect-reflect [elser2018] finds the responses from random starts.
    """
    require_instance(Beamformer, beamformer=beamformer)
    require_seed(seed=seed)
    spectra = check_stack("spectra", spectra)
    generator = np.random.default_rng(seed)
    frequencies = SpatialFrequencies.of(beamformer)
    steps = STEPS_PER_ELEMENT * max(frequencies.array.rows, frequencies.array.columns)
    steering, row, column = _some_directions(beamformer)
    responses = np.zeros((len(spectra), beamformer.array.elements), complex)
    residual = np.full(len(spectra), np.inf)
    for first in range(0, len(spectra), AT_ONCE):
        batch = slice(first, first + AT_ONCE)
        sought = frequencies.sampled(spectra[batch])
        values = spectra[batch][:, row, column].astype(np.float64)
        for _ in range(MOST_STEPS // steps):
            missing = np.flatnonzero(residual[batch] > GOOD)
            if not len(missing):
                break
            start = _searched(sought[missing], frequencies, steps, generator)
            found, offset = refined(start.reshape(len(missing), -1), values[missing], steering)
            error = np.abs(found @ steering.T) - values[missing] - offset[:, None]
            error = LARGEST_GREY * np.sqrt((error**2).mean(axis=1))
            better = error < residual[batch][missing]
            responses[first + missing[better]], residual[first + missing[better]] = found[better], error[better]
    return Retrieval(_in_one_form(responses), residual)


def _in_one_form(responses: Complex[np.ndarray, "K elements"]) -> Complex[np.ndarray, "K elements"]:
    """The same responses with one phase and flip: Σ y_m y_{MN−1−m} real, and both parts of Σ y_m positive."""
    symmetric = (responses * responses[:, ::-1]).sum(axis=1)
    turned = responses * np.exp(-0.5j * np.angle(symmetric))[:, None]
    turned = turned * np.where(turned.sum(axis=1).real < 0, -1, 1)[:, None]
    return np.where(turned.sum(axis=1).imag[:, None] < 0, turned[:, ::-1].conj(), turned)


def _some_directions(beamformer: Beamformer) -> tuple[Complex[np.ndarray, "P elements"], np.ndarray, np.ndarray]:
    """Steering vectors of pixels spread evenly over the hemisphere, with the pixels' rows and columns."""
    count = max(DIRECTIONS, DIRECTIONS_PER_ELEMENT * beamformer.array.elements)
    index = np.arange(count) + 0.5
    elevation, azimuth = np.degrees(np.arcsin(index / count)), np.degrees(np.pi * (1 + 5**0.5) * index) % 360
    grid = beamformer.grid
    row = np.abs(grid.elevations_deg - elevation[:, None]).argmin(axis=1)
    column = np.round(azimuth / grid.azimuth_step_deg).astype(int) % COLUMNS
    row, column = np.unique(np.stack([row, column]), axis=1)
    return beamformer.steering[row, column], row, column


@dataclass(frozen=True)
class SpatialFrequencies:
    """A grid of spatial frequencies for an array over one period of its transform.

    With the spacing d in wavelengths, a direction u has the spatial frequencies (d u_x, d u_y). Beamforming is, up to a
    factor of magnitude 1, the Fourier transform of the responses. Visible frequencies lie in a disk of radius d.
    """

    array: PlanarArray
    seen: Bool[np.ndarray, "y x"]  # whether a frequency belongs to a direction within the angular grid
    row: Int[np.ndarray, "y x"]  # row of the pixel nearest to this direction
    column: Int[np.ndarray, "y x"]  # its column

    @classmethod
    def of(cls, beamformer: Beamformer, oversampling: int = OVERSAMPLING) -> SpatialFrequencies:
        """The grid with ``oversampling`` frequencies for each row and column of the array."""
        grid = beamformer.grid
        array = require_planar(beamformer.array, "the search for responses behind pictures")
        y, x = (scipy.fft.fftfreq(oversampling * count) / array.spacing for count in (array.rows, array.columns))
        u_x, u_y = np.meshgrid(x, y)
        across = np.hypot(u_x, u_y)  # the cosine of the elevation
        elevation, azimuth = np.degrees(np.arccos(np.minimum(across, 1))), np.degrees(np.arctan2(u_y, u_x)) % 360
        row = np.rint((elevation - grid.elevation_first_deg) / grid.elevation_step_deg).astype(int)
        column = np.rint(azimuth / grid.azimuth_step_deg).astype(int)
        column[column * grid.azimuth_step_deg == 360] = 0
        return cls(array, (across <= 1) & (row >= 0) & (row < ROWS) & (column < COLUMNS), row, column)

    def sampled(self, spectra: Float[np.ndarray, "K 90 360"]) -> Float32[np.ndarray, "K y x"]:
        """Magnitudes at the frequencies, which are good enough to search with; 0 where not seen."""
        sampled = np.zeros((len(spectra), *self.seen.shape), np.float32)
        sampled[:, self.seen] = spectra[:, self.row[self.seen], self.column[self.seen]]
        return sampled

    def beams(self, responses: Complex[np.ndarray, "K rows columns"]) -> Complex[np.ndarray, "K y x"]:
        """Beams of element responses at the frequencies, as ``Beamformer.spectrum`` has them before the magnitude."""
        return scipy.fft.fft2(responses, s=self.seen.shape) * self.array.elements**-0.5

    def responses(self, beams: Complex[np.ndarray, "K y x"]) -> Complex[np.ndarray, "K rows columns"]:
        """The responses whose beams are nearest to some beams at all frequencies, seen or not (least squares)."""
        return scipy.fft.ifft2(beams)[:, : self.array.rows, : self.array.columns] * self.array.elements**0.5


def _searched(
    magnitude: Float[np.ndarray, "K y x"], frequencies: SpatialFrequencies, steps: int, generator: np.random.Generator
) -> Complex[np.ndarray, "K rows columns"]:
    """Responses with about these magnitudes, from a random start.

    With the projections P1 to the magnitudes and P2 to beams of M × N responses, a step from the beams b is

        b + β (P2(2 P1(b) − b) − P1(b))

    It rests where both projections agree. The offset of the magnitudes is left to the refinement.
    """
    array, seen = frequencies.array, frequencies.seen

    def with_magnitude(beams: np.ndarray) -> np.ndarray:
        return np.where(seen, beams * (magnitude / np.maximum(np.abs(beams), 1e-12)), beams)

    def of_responses(beams: np.ndarray) -> np.ndarray:
        return frequencies.beams(frequencies.responses(beams))

    shape = (len(magnitude), array.rows, array.columns)
    start = generator.standard_normal((*shape, 2), np.float32) @ np.array([1, 1j], np.complex64)
    if not seen.any():  # the elements are so close together that all directions look alike
        return start
    beams = frequencies.beams(start).astype(np.complex64)
    beams *= np.sqrt(np.square(magnitude).sum(axis=(1, 2)) / np.square(np.abs(beams)).sum(axis=(1, 2)))[:, None, None]
    relaxation = generator.uniform(*RELAXATION, (len(beams), 1, 1)).astype(np.float32)
    best, least = beams, np.full(len(beams), np.inf)
    for _ in range(steps):
        known = with_magnitude(beams)
        reflected = of_responses(2 * known - beams)
        cost = (np.abs(reflected) - magnitude)[:, seen].var(axis=1)
        best, least = np.where((cost < least)[:, None, None], reflected, best), np.minimum(cost, least)
        beams = beams + relaxation * (reflected - known)
    for _ in range(SETTLING_STEPS):
        best = of_responses(with_magnitude(best))
    return frequencies.responses(best)
