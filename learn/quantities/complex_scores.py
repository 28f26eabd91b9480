"""Scores of predicted complex responses, and the base of the quantities that are such responses."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Complex, Float

from learn.models.kriging.deviation_curve import NORMAL
from learn.quantities.quantity import Prediction, Quantity, Scored
from scenes.files.npz_file import Expected
from simulate.spectra.band import delay_spread

MOST_SNR_DB = 200.0  # Largest SNR that is stated. A prediction without any error gets it.


class OfComplex(Quantity):
    """Complex numbers [K, A, S] of A antennas and S subcarriers, whose level and phase must be right, too.

    The scores are "rows", the number of rows that are not zero, to which all others refer; the median, the mean and the
    10th percentile of the SNR of each row, 10 log₁₀ ‖y‖² / ‖y − ŷ‖², dB; the median of the correlation
    ``|ŷ^H y|`` / (‖ŷ‖ ‖y‖); the median error of the root mean square delay spread, ns; and the share of the real and
    imaginary parts within the stated 90 % intervals.
    """

    kinds = "fc"
    columns: ClassVar[Mapping[str, str]] = {
        "snr_median_db": "median SNR (dB)",
        "snr_mean_db": "mean SNR (dB)",
        "snr_p10_db": "10th % (dB)",
        "correlation_median": "median correlation",
        "delay_spread_error_median_ns": "delay spread off (ns)",
        "coverage_90": "in 90 % interval",
    }

    def bandwidth(self, dataset: Any) -> float | None:
        """Bandwidth of the predicted subcarriers, Hz. None: it is not known."""
        raise NotImplementedError

    def score(self, prediction: Prediction, truth: Complex[np.ndarray, "K A S"], dataset: Any) -> Scored:
        snr = snr_db(prediction.value, truth)
        return Scored(complex_scores(prediction, truth, self.bandwidth(dataset)), {"snr_db": snr})

    def arrays(self, shape: tuple[int, ...]) -> dict[str, Expected]:
        return {"snr_db": Expected("signal-to-noise ratios", "f", shape[:1])}


def complex_scores(
    prediction: Prediction, truth: Complex[np.ndarray, "K A S"], bandwidth: float | None
) -> dict[str, Any]:
    """The scores of all rows together; None where no row is heard."""
    snr = snr_db(prediction.value, truth)
    heard = ~np.isnan(snr)
    if not heard.any():
        return {"rows": 0, **dict.fromkeys(OfComplex.columns)}
    found, truth, snr = prediction.value[heard], truth[heard], snr[heard]
    late = None
    if bandwidth is not None:
        late = 1e9 * float(np.median(np.abs(delay_spread(found, bandwidth) - delay_spread(truth, bandwidth))))
    stated = prediction.deviation
    return {
        "rows": int(heard.sum()),
        "snr_median_db": float(np.median(snr)),
        "snr_mean_db": float(snr.mean()),
        "snr_p10_db": float(np.quantile(snr, 0.1)),
        "correlation_median": float(np.median(correlation(found, truth))),
        "delay_spread_error_median_ns": late,
        "coverage_90": None if stated is None else coverage(found - truth, stated[heard]),
    }


def snr_db(predicted: Complex[np.ndarray, "K A S"], truth: Complex[np.ndarray, "K A S"]) -> Float[np.ndarray, " K"]:
    """Signal-to-noise ratio of each row's prediction, 10 log₁₀ ‖h‖² / ‖h − ĥ‖², dB, as NeRF² defines it [zhao2023].

    It is 0 dB if zeros are predicted, and negative for worse predictions. It is NaN for a row of zeros.
    """
    signal, error = _energy(truth), _energy(predicted - truth)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.minimum(10 * np.log10(signal / error), MOST_SNR_DB)
    return np.where(signal > 0, ratio, np.nan)


def correlation(
    predicted: Complex[np.ndarray, "K *shape"], truth: Complex[np.ndarray, "K *shape"]
) -> Float[np.ndarray, " K"]:
    """Correlation ``|ĥ^H h|`` / (‖ĥ‖ ‖h‖) of each row, which a wrong level or common phase leaves as it is.

    It is 0 if zeros are predicted, and NaN for a row of zeros.
    """
    norm = np.sqrt(_energy(predicted) * _energy(truth))
    product = np.abs((predicted.conj() * truth).reshape(len(truth), -1).sum(axis=1))
    return np.where(_energy(truth) > 0, product / np.where(norm > 0, norm, 1), np.nan)


def coverage(error: Complex[np.ndarray, "K A S"], deviation: Float[np.ndarray, " K"]) -> float:
    """Share of the real and imaginary parts of errors within the 90 % interval of a normal distribution."""
    bound = NORMAL * deviation[:, None, None]
    return float(np.mean([np.abs(error.real) <= bound, np.abs(error.imag) <= bound]))


def _energy(channels: Complex[np.ndarray, "K *shape"]) -> Float[np.ndarray, " K"]:
    return np.square(np.abs(channels).astype(float)).reshape(len(channels), -1).sum(axis=1)
