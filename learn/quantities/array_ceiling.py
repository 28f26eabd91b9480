"""The array's ceiling: how well the best element responses reproduce a spectrum.

An array of MN elements measures only spectra of the form |A y|, with its steering vectors A and element responses y.
The best y for each test spectrum gives an upper bound on the score of every model that computes spectra from element
responses. It also shows how much of a measured spectrum the array cannot explain.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Complex, Float

from simulate.dataset.dataset import Dataset
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.element_array import uniform
from simulate.spectra.phase_retrieval import GOOD, retrieve_responses
from simulate.spectra.spectrum import LARGEST_GREY, normalise

CEILING = "array's ceiling"  # name of the bound in results and in their files

NO_CEILING = "without recorded responses, it can be found for uniform planar arrays alone"
"""Why a dataset has no ceiling, for the user."""

SAMPLES = 50  # largest number of test spectra to which the ceiling is fitted; a fit takes a fraction of a second


def shown_name(name: str) -> str:
    """The name of a method or of the bound as tables and figures show it."""
    return f"{name} (bound)" if name == CEILING else name


def has_ceiling(dataset: Dataset) -> bool:
    """Whether the ceiling of a dataset's array can be found: it has responses, or a uniform planar array."""
    return "response" in dataset.values or uniform(dataset.array) is not None


def array_ceiling(
    truth: Float[np.ndarray, "K 90 360"],
    beamformer: Beamformer,
    recorded: Complex[np.ndarray, "K elements"] | None = None,
) -> Float[np.ndarray, "K 90 360"]:
    """The spectra of the form normalise(|A y|) that fit the true spectra best.

    Recorded responses that reproduce a spectrum are the best ones. All others are found behind the spectra, which needs
    a uniform planar array; recorded ones of other arrays are taken as they are.
    """
    if recorded is None:
        return normalise(beamformer.spectrum(retrieve_responses(truth, beamformer).responses))
    best = normalise(beamformer.spectrum(recorded))
    error = LARGEST_GREY * np.sqrt(np.square(best - truth).mean(axis=(1, 2)))
    others = np.flatnonzero(error > GOOD)
    if len(others) and uniform(beamformer.array) is not None:
        best[others] = array_ceiling(truth[others], beamformer)
    return best
