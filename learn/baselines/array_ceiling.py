"""The array's ceiling: how well any set of element responses can reproduce a spectrum.

An array of MN elements only measures spectra of the form |A y|. The best y for each test spectrum gives an upper bound
of the score of any model that respects the array, and tells how much of a measured spectrum the array cannot explain.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Complex, Float

from simulate.array import PlanarArray
from simulate.spectrum import normalise

CEILING = "array's ceiling"
"""Name of the bound in tables and figures."""

SAMPLES = 50
"""Number of test spectra the ceiling is fitted to; a fit takes a fraction of a second each."""

STARTS, ITERATIONS = 4, 120
FLOORS = (0.0, 0.03, 0.1)
"""Smallest magnitude a spectrum may have had before min–max normalisation took it off, as a share of the span."""

EVERY_DEG = 6
"""The fit looks at every sixth row and column: a 4 × 4 array resolves nothing finer."""


def array_ceiling(truth: Float[np.ndarray, "K 90 360"], array: PlanarArray) -> Float[np.ndarray, "K 90 360"]:
    """The spectra of the form normalise(|A y|) that fit each true spectrum best."""
    return normalise(array.spectrum(responses_of(truth, array)))


def responses_of(spectra: Float[np.ndarray, "K 90 360"], array: PlanarArray) -> Complex[np.ndarray, "K elements"]:
    """Element responses y that reproduce each spectrum best, up to a scale and a phase.

    Phase retrieval by error reduction (Gerchberg and Saxton 1972): y ← A⁺ (s e^{j∠(A y)}), s the spectrum plus a floor,
    from several random starts and for several floors, since the problem is not convex; the best fit counts.
    """
    steering = array.steering[::EVERY_DEG, ::EVERY_DEG].reshape(-1, array.elements)
    inverse = np.linalg.pinv(steering)
    generator = np.random.default_rng(0)
    best = []
    for spectrum in spectra:
        wanted = spectrum[::EVERY_DEG, ::EVERY_DEG].reshape(-1).astype(np.float64)
        magnitude = np.repeat([wanted + floor for floor in FLOORS], STARTS, axis=0)
        y = generator.standard_normal((len(magnitude), array.elements, 2)) @ [1, 1j]
        for _ in range(ITERATIONS):
            field = y @ steering.T
            y = (magnitude * np.exp(1j * np.angle(field))) @ inverse.T
        found = np.abs(y @ steering.T)
        low, high = found.min(axis=1, keepdims=True), found.max(axis=1, keepdims=True)
        error = (((found - low) / (high - low) - wanted) ** 2).mean(axis=1)
        best.append(y[error.argmin()])
    return np.array(best)
