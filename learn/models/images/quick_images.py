"""The sum of mirror images' waves by a compiled loop over positions. ``image_waves`` is its slow reference.

The loop over images takes several at a time, since a polynomial in place of the library's functions gives the cosine
and the sine: of half the phase, after whole periods are removed, to 1e-10.
"""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Complex, Float

from learn.models.images.mirror_images import STEP
from simulate.parallel.compiled import SUMS, compiled, in_threads

TASK = 8  # number of positions that a thread takes at a time

COSINE = tuple((-1) ** n / math.factorial(2 * n) for n in range(8))
SINE = tuple((-1) ** n / math.factorial(2 * n + 1) for n in range(8))
"""Taylor coefficients of cos x and of (sin x) / x in x², for ``|x| ≤ π/2``."""


@compiled(nogil=True, fastmath=SUMS, error_model="numpy")
def _add_up(positions, elements, amplitudes, responses):
    """Write the sums of waves into ``responses`` [K, elements]."""
    for k in range(len(positions)):
        x, y, z = positions[k, 0], positions[k, 1], positions[k, 2]
        for m in range(len(elements)):
            real = imaginary = 0.0
            for j in range(elements.shape[2]):
                dx, dy, dz = x - elements[m, 0, j], y - elements[m, 1, j], z - elements[m, 2, j]
                away = math.sqrt(dx * dx + dy * dy + dz * dz)
                half = np.pi * (away - np.floor(away + 0.5))
                u = half * half
                c = s = 0.0
                for n in range(7, -1, -1):  # Horner's scheme
                    c, s = c * u + COSINE[n], s * u + SINE[n]
                s *= half
                magnitude = 1 / max(away, STEP)
                cosine, sine = magnitude * (1 - 2 * s * s), magnitude * (2 * s * c)
                real += cosine * amplitudes[0, j] + sine * amplitudes[1, j]
                imaginary += cosine * amplitudes[1, j] - sine * amplitudes[0, j]
            responses[k, m] = complex(real, imaginary)


def sum_of_waves(
    positions: Float[np.ndarray, "K 3"],
    elements: Float[np.ndarray, "J elements 3"],
    amplitudes: Float[np.ndarray, "J 2"],
    wavelength: float,
) -> Complex[np.ndarray, "K elements"]:
    """The sums Σ_j x_j e^{−jkR}/R over images, R in wavelengths.

    >>> one = np.zeros((1, 1, 3))
    >>> sum_of_waves(np.array([[0.0, 0, 2.25]]), one, np.array([[9.0, 0]]), wavelength=1.0).round(6).tolist()
    [[-4j]]
    """
    places = np.ascontiguousarray(positions / wavelength, np.float64)
    by_element = np.ascontiguousarray(np.moveaxis(elements / wavelength, 0, -1), np.float64)
    numbers = np.ascontiguousarray(amplitudes.T, np.float64)
    found = np.empty((len(places), len(by_element)), np.complex128)

    def write_some(some: slice) -> None:
        _add_up(places[some], by_element, numbers, found[some])  # type: ignore[call-arg]

    in_threads(write_some, len(places), TASK)
    return found
