"""The array's ceiling: how well the best element responses reproduce a spectrum.

An array of MN elements only measures spectra of the form |A y|, with its steering vectors A and element responses y.
The best y for each test spectrum gives an upper bound on the score of every model that computes spectra from element
responses, and shows how much of a measured spectrum the array cannot explain.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Complex, Float

from simulate.array import PlanarArray
from simulate.spectrum import normalise

CEILING = "array's ceiling"
"""Name of the bound in results and their files."""

SAMPLES = 50
"""Number of test spectra that the ceiling is fitted to; a fit takes a fraction of a second."""

STARTS, ITERATIONS = 4, 120
"""Number of random starts of a fit, and number of iterations of each."""

FLOORS = (0.0, 0.03, 0.1)
"""Trial values of the minimum that normalisation subtracted from the magnitude, relative to maximum − minimum."""

EVERY_DEG = 6
"""The fit uses every sixth row and column of a spectrum; a 4 × 4 array resolves no finer detail."""


def shown_name(name: str) -> str:
    """The name of a method or of the bound as tables and figures show it.

    >>> shown_name("nearest"), shown_name(CEILING)
    ('nearest', "array's ceiling (bound)")
    """
    return f"{name} (bound)" if name == CEILING else name


def array_ceiling(truth: Float[np.ndarray, "K 90 360"], array: PlanarArray) -> Float[np.ndarray, "K 90 360"]:
    """The spectra of the form normalise(|A y|) that fit the true spectra best.

    Args:
        truth: true spectra, 0…1.
        array: the gateway's array.
    """
    return normalise(array.spectrum(responses_of(truth, array)))


def responses_of(spectra: Float[np.ndarray, "K 90 360"], array: PlanarArray) -> Complex[np.ndarray, "K elements"]:
    """Element responses y that reproduce each spectrum best, up to a scale and a phase.

    Phase retrieval by error reduction (Gerchberg and Saxton 1972): y ← A⁺ (s e^{j∠(A y)}), where s is the spectrum plus
    a floor. The problem is not convex: the iteration starts from several random y for each of several floors, and the
    result is the y with the least squared error.

    Args:
        spectra: spectra, 0…1.
        array: the gateway's array.
    """
    steering = array.steering[::EVERY_DEG, ::EVERY_DEG].reshape(-1, array.elements)
    pseudo_inverse = np.linalg.pinv(steering)
    generator = np.random.default_rng(0)
    best_responses = []
    for spectrum in spectra:
        target = spectrum[::EVERY_DEG, ::EVERY_DEG].reshape(-1).astype(np.float64)
        magnitude = np.repeat([target + floor for floor in FLOORS], STARTS, axis=0)
        y = generator.standard_normal((len(magnitude), array.elements, 2)) @ [1, 1j]
        for _ in range(ITERATIONS):
            field = y @ steering.T
            y = (magnitude * np.exp(1j * np.angle(field))) @ pseudo_inverse.T
        fitted = np.abs(y @ steering.T)
        low, high = fitted.min(axis=1, keepdims=True), fitted.max(axis=1, keepdims=True)
        error = (((fitted - low) / (high - low) - target) ** 2).mean(axis=1)
        best_responses.append(y[error.argmin()])
    return np.array(best_responses)
