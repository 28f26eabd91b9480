"""Fingerprints: spectra as vectors of length 1 that do not depend on the spectrum's scale and offset.

The scalar product ρ of two fingerprints is the correlation of two spectra over the hemisphere, and the square of their
distance is 2 (1 − ρ). A few hundred numbers hold all that the array can resolve (``learn.models.quadrature``).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import torch
from jaxtyping import Float, UInt8

from learn.models.quadrature import quadrature
from learn.training.prediction import batches_for
from learn.training.run_files import read_training
from learn.training.run_folder import Run
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.spectrum import spectrum_of

AT_ONCE = 256  # Number of positions that a model predicts at once

JUDGED = 100  # Number of positions over which a run's deviation is averaged


class Fingerprints:
    """Fingerprints of an array's spectra."""

    def __init__(self, beamformer: Beamformer):
        self.pixels = quadrature(beamformer)
        # The weight of a pixel is its solid angle, which is small near boresight.
        height = np.cos(np.radians(beamformer.grid.elevations_deg[self.pixels.rows]))
        weights = np.repeat(self.pixels.weights * height, len(self.pixels.columns))
        self._weights = weights / weights.sum()

    def of_pictures(self, pictures: UInt8[np.ndarray, "K 90 360"]) -> Float[np.ndarray, "K F"]:
        """Fingerprints of pictures."""
        return self._of(spectrum_of(pictures[:, self.pixels.rows][:, :, self.pixels.columns]))

    def predicted(self, run: Run, positions: Float[np.ndarray, "K 3"]) -> Float[np.ndarray, "K F"]:
        """Fingerprints that a run predicts."""
        found = []
        with torch.inference_mode():
            for batch in batches_for(run.model, positions, AT_ONCE):
                found.append(self._of(run.model.coarse(batch, self.pixels).float().cpu().numpy()))
        return np.concatenate(found)

    def _of(self, spectra: Float[np.ndarray, "K H W"]) -> Float[np.ndarray, "K F"]:
        values = spectra.reshape(len(spectra), -1).astype(np.float64)
        values = (values - (values @ self._weights)[:, None]) * np.sqrt(self._weights)
        length = np.linalg.norm(values, axis=1, keepdims=True)  # 0 for a spectrum without any contrast
        return (values / np.maximum(length, 1e-12)).astype(np.float32)


class Field:
    """The fingerprints that several gateways' runs predict together: those of each gateway times √w, concatenated.

    The weight w of a gateway is proportional to 1/σ², with the deviation σ that its run states
    (conformal_deviation.py), and the weights add up to 1. A gateway whose predictions may be far off therefore
    counts less. Deviations fitted to few validation spectra are uncertain, so they are moved towards each other. If a
    run states none, all weights are equal.
    """

    def __init__(self, runs: Sequence[Run]):
        self._runs = list(runs)
        self._fingerprints = [Fingerprints(run.beamformer) for run in self._runs]
        self._weights = _weights(self._runs)
        elements = sum(run.beamformer.array.elements for run in self._runs)
        self.numbers = 2 * elements - 2 * len(self._runs)
        """Number of real numbers that the spectra determine: the responses without a phase and a scale per gateway."""

    def of_pictures(self, pictures: Sequence[UInt8[np.ndarray, "K 90 360"]]) -> Float[np.ndarray, "K F"]:
        """Fingerprints of the pictures that each gateway took of the same K transmitters."""
        both = zip(self._fingerprints, pictures, strict=True)
        return self._together([one.of_pictures(seen) for one, seen in both])

    def predicted(
        self, positions: Float[np.ndarray, "K 3"], report: Callable[[int, int], None] = lambda done, total: None
    ) -> Float[np.ndarray, "K F"]:
        """Fingerprints of transmitters at positions (metres, world frame). ``report`` is told how many are done."""
        found = []
        for start in range(0, len(positions), 4 * AT_ONCE):
            report(start, len(positions))
            some = positions[start : start + 4 * AT_ONCE]
            both = zip(self._fingerprints, self._runs, strict=True)
            found.append(self._together([one.predicted(run, some) for one, run in both]))
        return np.concatenate(found)

    def _together(self, each: list[Float[np.ndarray, "K f"]]) -> Float[np.ndarray, "K F"]:
        return np.concatenate([one * np.float32(w**0.5) for one, w in zip(each, self._weights, strict=True)], axis=1)


def _weights(runs: list[Run]) -> Float[np.ndarray, " G"]:
    """Weight of each run's fingerprints, from the mean variance that it states over its region."""
    if len(runs) == 1:
        return np.ones(1)
    variances, uncertain = [], []
    for run in runs:
        low, high = run.model.region.double().cpu().numpy()
        everywhere = np.random.default_rng(0).uniform(low, high, (JUDGED, 3))
        deviation, told_by = run.deviation(everywhere), read_training(run.folder).deviation
        if deviation is None or told_by is None or not told_by.spectra:
            return np.full(len(runs), 1 / len(runs))
        variances.append(np.mean(deviation**2))
        uncertain.append(2 / told_by.spectra)
    return inverse_variance_weights(np.array(variances), np.array(uncertain))


def inverse_variance_weights(
    variances: Float[np.ndarray, " G"], uncertain: Float[np.ndarray, " G"]
) -> Float[np.ndarray, " G"]:
    """Weights proportional to 1/σ², which add up to 1, with each log σ² moved towards the mean of all.

    A variance that is estimated from validation spectra is uncertain, so that the logarithms are spread more widely
    than the true ones. They keep the share max(0, 1 − (mean of u) / (their variance)) of their distance to the mean,
    where u is the variance of each logarithm (empirical Bayes [efron1973]).

    >>> inverse_variance_weights(np.array([1.0, 4.0]), np.array([0.0, 0.0])).tolist()
    [0.8, 0.2]
    >>> inverse_variance_weights(np.array([1.0, 1.5]), np.array([0.2, 0.2])).tolist()
    [0.5, 0.5]
    """
    logarithms = np.log(variances)
    spread = logarithms.var(ddof=1)
    share = max(0.0, 1 - uncertain.mean() / spread) if spread > 0 else 0.0
    weights = np.exp(-share * (logarithms - logarithms.mean()))
    return weights / weights.sum()
