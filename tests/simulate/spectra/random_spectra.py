"""Random responses of an array, and their spectra: complex normal, the same for the same seed."""

import numpy as np

from simulate.spectra.beamformer import Beamformer


def random_responses(count: int, elements: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal((count, elements, 2)) @ [1, 1j]


def random_spectra(beamformer: Beamformer, count: int = 6) -> np.ndarray:
    return beamformer.spectrum(random_responses(count, beamformer.array.elements))
