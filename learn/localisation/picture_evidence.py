"""Spectra that runs predict, as evidence of places: fingerprints do not depend on a spectrum's scale and offset.

The scalar product ρ of two fingerprints is the correlation of two spectra over the hemisphere, and the square of their
distance is 2 (1 − ρ). A few hundred numbers hold all that the array can resolve (``learn.models.quadrature``).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np
import torch
from jaxtyping import Bool, Float, UInt8

from learn.localisation.evidence import Evidence, Prior
from learn.models.quadrature import quadrature
from learn.training.prediction import batches_for
from learn.training.run_files import read_training
from learn.training.run_folder import SpectrumRun
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.spectrum import spectrum_of

AT_ONCE = 256  # Number of positions that a model predicts at once

JUDGED = 100  # Number of positions over which a run's deviation is averaged

TOLD = 1 / 4
"""Share of the spectra's numbers whose errors are independent; errors of neighbouring elements are similar."""

LEAST_MISFIT = 1e-4  # Misfit that rounding the pictures causes

STEP = 0.01
"""Least step of the derivatives, wavelengths: a field that is fitted to neighbours is rough where these change."""


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

    def predicted(self, run: SpectrumRun, positions: Float[np.ndarray, "K 3"]) -> Float[np.ndarray, "K F"]:
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


class PictureEvidence(Evidence):
    """Fingerprints of K transmitters at several gateways: those of each gateway times √w, concatenated.

    The weight w of a gateway is proportional to 1/σ², with the deviation σ that its run states
    (conformal_deviation.py), and the weights add up to 1. A gateway whose predictions may be far off therefore
    counts less. The likelihood ``misfit^(−n/2)`` is that of n normal errors of unknown size.
    """

    numbers: float

    def __init__(
        self,
        runs: Sequence[SpectrumRun],
        pictures: Sequence[UInt8[np.ndarray, "K 90 360"]],
        region: Float[np.ndarray, "2 3"],
        known: Float[np.ndarray, "n 3"],
        known_pictures: Callable[[], list[UInt8[np.ndarray, "n 90 360"]]] | None = None,
    ):
        self._runs, self._pictures, self._known_pictures = list(runs), pictures, known_pictures
        self._fingerprints = [Fingerprints(run.beamformer) for run in runs]
        self._weights = _weights(self._runs)
        # The responses that the spectra determine have no phase and no scale for each gateway.
        self.numbers = TOLD * 2 * sum(run.beamformer.array.elements - 1 for run in runs)
        wavelength = float(runs[0].model.wavelength)
        self.prior = Prior(known, wavelength)
        both = zip(self._fingerprints, pictures, strict=True)
        super().__init__(self._together([one.of_pictures(seen) for one, seen in both]), region, wavelength, known)

    @property
    def told(self) -> Bool[np.ndarray, " K"]:
        """Pictures of a single grey level tell nothing."""
        return np.any(self.heard != 0, axis=1)

    def log_likelihood(
        self, points: Float[np.ndarray, "n 3"], heard: Float[np.ndarray, "k F"]
    ) -> Iterator[Float[np.ndarray, " n"]]:
        """By the distance of measured and predicted fingerprint."""
        there = self._predicted(points)
        for row in heard:
            yield -self.numbers / 2 * np.log(LEAST_MISFIT + _squared_distance(there, row))

    def misfit(self, points: Float[np.ndarray, "n 3"], row: Float[np.ndarray, " F"]) -> Float[np.ndarray, " n"]:
        """Squared distance of measured and predicted fingerprint."""
        return _squared_distance(self._predicted(points), row)

    def derivatives(
        self,
        positions: Float[np.ndarray, "M 3"],
        row: Float[np.ndarray, " F"],
        axes: Float[np.ndarray, "d 3"],
        step: Float[np.ndarray, "M d"],
    ) -> tuple[Float[np.ndarray, "M d"], Float[np.ndarray, "M d d"]]:
        """By the derivatives of the fingerprints (Gauss–Newton), whose covariances hold more of the true positions."""
        step = np.maximum(step, STEP * self.wavelength)
        beside = positions[:, None, None] + np.array([[1], [-1]])[..., None] * (step[:, None, :, None] * axes)
        there = self._predicted(np.concatenate([positions, beside.reshape(-1, 3)])).astype(float)
        off, beside = row - there[: len(positions)], there[len(positions) :].reshape(len(positions), 2, len(axes), -1)
        slope = (beside[:, 0] - beside[:, 1]) / (2 * step[..., None])
        weight = self.numbers / (LEAST_MISFIT + np.square(off).sum(axis=1))
        curvature = weight[:, None, None] * slope @ slope.transpose(0, 2, 1)
        return weight[:, None] * np.einsum("mdf,mf->md", slope, off), curvature

    def unlike(self) -> Float[np.ndarray, "K n"] | None:
        """Minus the scalar products of the fingerprints, added up over the gateways."""
        if self._known_pictures is None:
            return None
        both = zip(self._fingerprints, self._pictures, self._known_pictures(), strict=True)
        return -sum(one.of_pictures(seen) @ one.of_pictures(known).T for one, seen, known in both)

    def _predicted(self, positions: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n F"]:
        found = []
        for start in range(0, len(positions), 4 * AT_ONCE):
            if len(positions) > 4 * AT_ONCE:
                self.report("field on a grid", start, len(positions))
            some = positions[start : start + 4 * AT_ONCE]
            both = zip(self._fingerprints, self._runs, strict=True)
            found.append(self._together([one.predicted(run, some) for one, run in both]))
        return np.concatenate(found)

    def _together(self, each: list[Float[np.ndarray, "K f"]]) -> Float[np.ndarray, "K F"]:
        return np.concatenate([one * np.float32(w**0.5) for one, w in zip(each, self._weights, strict=True)], axis=1)


def _squared_distance(there: Float[np.ndarray, "n F"], row: Float[np.ndarray, " F"]) -> Float[np.ndarray, " n"]:
    if len(there) > 4 * AT_ONCE:  # on a grid; for derivatives, single precision is too rough
        return np.maximum(0, 2 - 2 * there @ row)
    return np.square(there - row, dtype=float).sum(axis=1)


def _weights(runs: list[SpectrumRun]) -> Float[np.ndarray, " G"]:
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
