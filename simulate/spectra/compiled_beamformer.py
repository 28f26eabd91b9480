"""Normalised spectra of element responses, in single precision or 8 bits, by a compiled loop over a quarter of pixels.

The grid's azimuths are 1° apart, so a mirror at the x or the y axis takes every pixel to a pixel. With the element
positions (x_m, y_m, z_m), k = 2π per wavelength and a_m = k u_x |x_m|, b_m = k u_y |y_m|,

    e^{−jk(u_x x_m + u_y y_m)} = (cos a_m ∓ j sin a_m)(cos b_m ∓ j sin b_m),

and only the signs of sin a_m and sin b_m change under the mirrors. The four sums over m of the products cos·cos,
sin·cos, cos·sin and sin·sin in the first quadrant therefore give, added with four choices of signs, the beams in all
four quadrants. Elements that are mirror images of one another share their products: a 4 × 4 array has 16 real functions
at 90 × 91 pixels in place of 16 complex numbers at 90 × 360. The third coordinate, z_m, multiplies the products by the
cosine or the sine of k u_z |z_m|.

The magnitude grows with the power, so the smallest and the largest power tell the range before any root is taken.
"""

from __future__ import annotations

from functools import lru_cache
from itertools import product

import numpy as np
from jaxtyping import Bool, Complex, Float, UInt8

from simulate.parallel.compiled import compiled, in_threads
from simulate.spectra.angular_grid import COLUMNS, ROWS
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.spectrum import LARGEST_GREY

LEAST_SPAN = 1e-6
"""Smallest difference of the extreme magnitudes by which a spectrum is divided, for a largest response of 1."""

ACROSS = COLUMNS // 4 + 1  # Columns of the first quadrant, 0° to 90°

TILE = 256
"""Number of pixels that are summed at a time, so that their functions and sums stay in the first cache."""

TILES = -(-ROWS * ACROSS // TILE)

UNROLLED = 4  # Number of functions that one pass over a tile adds

AT_ONCE = 4  # Number of spectra whose powers a thread keeps at a time, half a megabyte

TASK = 8  # Number of spectra that a thread takes at a time

SAME_DISTANCE = 9  # Decimals, in wavelengths, to which coordinates of mirror images agree

Spectra = Float[np.ndarray, "K 90 360"] | UInt8[np.ndarray, "K 90 360"]


@compiled(nogil=True, fastmath=True)
def _write(factors, functions, starts, spectra, largest):
    """Write normalised spectra into ``spectra`` [K, 90, 360]."""
    count, tiles = factors.shape[0], functions.shape[0]
    powers = np.empty((AT_ONCE, 4, tiles * TILE), np.float32)
    real, imaginary = np.zeros((4, TILE), np.float32), np.zeros((4, TILE), np.float32)
    low, high = np.empty(AT_ONCE, np.float32), np.empty(AT_ONCE, np.float32)
    zero, half = np.float32(0), np.float32(0.5 if largest > 1 else 0)
    for first in range(0, count, AT_ONCE):
        some = min(AT_ONCE, count - first)
        low[:] = np.inf
        high[:] = 0
        for tile in range(tiles):
            for s in range(some):
                for q in range(4):
                    real[q] = 0
                    imaginary[q] = 0
                    for f in range(starts[q], starts[q + 1], UNROLLED):
                        r0, i0 = factors[first + s, f, 0], factors[first + s, f, 1]
                        r1, i1 = factors[first + s, f + 1, 0], factors[first + s, f + 1, 1]
                        r2, i2 = factors[first + s, f + 2, 0], factors[first + s, f + 2, 1]
                        r3, i3 = factors[first + s, f + 3, 0], factors[first + s, f + 3, 1]
                        for p in range(TILE):
                            v0, v1 = functions[tile, f, p], functions[tile, f + 1, p]
                            v2, v3 = functions[tile, f + 2, p], functions[tile, f + 3, p]
                            real[q, p] += r0 * v0 + r1 * v1 + r2 * v2 + r3 * v3
                            imaginary[q, p] += i0 * v0 + i1 * v1 + i2 * v2 + i3 * v3
                least, most = low[s], high[s]
                for p in range(TILE):
                    # With the signs of the mirror at the y–z plane, then with those of the mirror at the x–z plane.
                    sum_r, sum_i = real[0, p] + real[1, p], imaginary[0, p] + imaginary[1, p]
                    turned_r, turned_i = real[2, p] + real[3, p], imaginary[2, p] + imaginary[3, p]
                    less_r, less_i = real[0, p] - real[1, p], imaginary[0, p] - imaginary[1, p]
                    fewer_r, fewer_i = real[2, p] - real[3, p], imaginary[2, p] - imaginary[3, p]
                    r0, i0 = sum_r + turned_r, sum_i + turned_i
                    r1, i1 = less_r + fewer_r, less_i + fewer_i
                    r2, i2 = less_r - fewer_r, less_i - fewer_i
                    r3, i3 = sum_r - turned_r, sum_i - turned_i
                    p0, p1 = r0 * r0 + i0 * i0, r1 * r1 + i1 * i1
                    p2, p3 = r2 * r2 + i2 * i2, r3 * r3 + i3 * i3
                    powers[s, 0, tile * TILE + p] = p0
                    powers[s, 1, tile * TILE + p] = p1
                    powers[s, 2, tile * TILE + p] = p2
                    powers[s, 3, tile * TILE + p] = p3
                    least = min(least, min(min(p0, p1), min(p2, p3)))
                    most = max(most, max(max(p0, p1), max(p2, p3)))
                low[s], high[s] = least, most
        for s in range(some):
            bottom = np.sqrt(low[s])
            scale = np.float32(largest / max(np.sqrt(high[s]) - bottom, LEAST_SPAN))
            top = np.float32(largest + half)
            for row in range(ROWS):
                start = row * ACROSS
                for c in range(ACROSS):
                    value = (np.sqrt(powers[s, 0, start + c]) - bottom) * scale + half
                    spectra[first + s, row, c] = min(max(value, zero), top)
                for c in range(1, ACROSS - 1):
                    value = (np.sqrt(powers[s, 1, start + c]) - bottom) * scale + half
                    spectra[first + s, row, 180 - c] = min(max(value, zero), top)
                for c in range(ACROSS):
                    value = (np.sqrt(powers[s, 2, start + c]) - bottom) * scale + half
                    spectra[first + s, row, 180 + c] = min(max(value, zero), top)
                for c in range(1, ACROSS - 1):
                    value = (np.sqrt(powers[s, 3, start + c]) - bottom) * scale + half
                    spectra[first + s, row, 360 - c] = min(max(value, zero), top)


class CompiledBeamformer:
    """Computes the normalised spectra of responses for one array and a grid whose azimuths are 1° apart."""

    def __init__(self, beamformer: Beamformer):
        positions = beamformer.array.positions
        places, group = np.unique(np.abs(positions).round(SAME_DISTANCE), axis=0, return_inverse=True)
        quadrant = beamformer.grid.directions[:, :ACROSS].reshape(-1, 3)
        # Pixels beyond the last one repeat it, and so do not change the range of a spectrum.
        directions = np.pad(quadrant, ((0, TILES * TILE - len(quadrant)), (0, 0)), mode="edge")
        functions, factors, starts = [], [], [0]
        for sine_y, sine_x in product((False, True), repeat=2):
            for sine_z, (index, place) in product((False, True), enumerate(places)):
                sines = np.array([sine_x, sine_y, sine_z])
                if (sines & (place == 0)).any():
                    continue  # the sine of 0
                phases = 2 * np.pi * directions * place
                value = np.where(sines, np.sin(phases), np.cos(phases)).prod(axis=1)
                signs = np.where(sines, np.sign(positions), 1).prod(axis=1)
                functions.append(value.astype(np.float32))
                factors.append(np.where(group.ravel() == index, signs, 0) * (-1j) ** sines.sum())
            while len(functions) == starts[-1] or len(functions) % UNROLLED:
                functions.append(np.zeros(TILES * TILE, np.float32))
                factors.append(np.zeros(len(positions), complex))
            starts.append(len(functions))
        by_tile = np.stack(functions).reshape(len(functions), TILES, TILE).swapaxes(0, 1)
        self._functions, self._starts = np.ascontiguousarray(by_tile), np.array(starts)
        self._factors = np.stack(factors, axis=1).astype(np.complex64)

    def write(
        self, responses: Complex[np.ndarray, "K elements"], spectra: Spectra, weight: float = 1
    ) -> Bool[np.ndarray, " K"]:
        """Write min–max normalised spectra, 0 to ``weight`` or in grey levels, and return which responses are finite.

        The scale and the common phase of responses have no effect. Spectra that are not finite are nan or black.
        """
        numbers = np.ascontiguousarray(responses, np.complex64).view(np.float32)
        # Powers of weak links would be too small for single precision.
        largest = np.abs(numbers).max(axis=1)
        finite = np.isfinite(largest)
        scale = np.where(finite & (largest > 0), largest, np.float32(1))[:, None]
        scaled = np.where(finite[:, None], numbers / scale, np.float32(0)).view(np.complex64)
        factors = (scaled @ self._factors).view(np.float32).reshape(len(scaled), self._factors.shape[1], 2)
        most = weight * (LARGEST_GREY if spectra.dtype == np.uint8 else 1)

        def write_some(some: slice) -> None:
            _write(factors[some], self._functions, self._starts, spectra[some], most)  # type: ignore[call-arg]

        in_threads(write_some, len(scaled), TASK)
        if spectra.dtype != np.uint8:
            spectra[~finite] = np.nan
        return finite


@lru_cache(maxsize=4)
def compiled_beamformer(beamformer: Beamformer) -> CompiledBeamformer | None:
    """What computes normalised spectra of an array on a grid quickly. None: the grid's azimuths are not 1° apart."""
    return CompiledBeamformer(beamformer) if abs(beamformer.grid.azimuth_step_deg) == 1 else None
