"""A field of random plane waves in free space, whose law is known, and a dataset of it."""

import numpy as np

from simulate.dataset.dataset import Dataset
from simulate.dataset.receivers import ArrayReceiver
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.spectrum import picture

BEAMFORMER = Beamformer()
WAVELENGTH = 0.3276


def plane_waves(positions: np.ndarray, count: int, seed: int) -> np.ndarray:
    """Responses [K, 16] of a field of random plane waves: exact solutions of the Helmholtz equation."""
    generator = np.random.default_rng(seed)
    directions = generator.standard_normal((count, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    amplitudes = generator.standard_normal((count, BEAMFORMER.array.elements, 2)) @ [1, 1j]
    return np.exp(2j * np.pi / WAVELENGTH * positions @ directions.T) @ amplitudes


def dataset_of(positions: np.ndarray, responses: np.ndarray, keep_responses: bool = True) -> Dataset:
    count = len(positions)
    return Dataset(
        folder=None,  # type: ignore[arg-type]
        names=[f"{i + 1:05d}" for i in range(count)],
        values={
            "spectrum": picture(BEAMFORMER.spectrum(responses)),
            **({"response": responses.astype(np.complex64)} if keep_responses else {}),
        },
        receiver=ArrayReceiver(np.zeros(3), np.array([0, 0, 0, 1.0])),
        places=positions,
        train=np.arange(count),
        test=np.arange(0),
        metadata={"frequency_hz": 299_792_458 / WAVELENGTH},
    )
