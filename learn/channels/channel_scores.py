"""Scores of predicted channels."""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import Complex, Float

from learn.models.kriging.deviation_curve import NORMAL
from simulate.spectra.band import delay_spread

MOST_SNR_DB = 200.0  # Largest SNR that is stated. A prediction without any error gets it.


SCORES = (
    "snr_median_db",
    "snr_mean_db",
    "snr_p10_db",
    "correlation_median",
    "delay_spread_error_median_ns",
    "coverage_90",
)
"""Keys of the scores of a row."""


def snr_db(predicted: Complex[np.ndarray, "K A S"], truth: Complex[np.ndarray, "K A S"]) -> Float[np.ndarray, " K"]:
    """Signal-to-noise ratio of each row's prediction, 10 log₁₀ ‖h‖² / ‖h − ĥ‖², dB, as NeRF² defines it [zhao2023].

    It is 0 dB if zeros are predicted, and negative for worse predictions. It is NaN for a link of zeros.
    """
    signal, error = _energy(truth), _energy(predicted - truth)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.minimum(10 * np.log10(signal / error), MOST_SNR_DB)
    return np.where(signal > 0, ratio, np.nan)


def correlation(
    predicted: Complex[np.ndarray, "K A S"], truth: Complex[np.ndarray, "K A S"]
) -> Float[np.ndarray, " K"]:
    """Correlation ``|ĥ^H h|`` / (‖ĥ‖ ‖h‖) of each row, which a wrong level or common phase leaves as it is.

    It is 0 if zeros are predicted, and NaN for a link of zeros.
    """
    norm = np.sqrt(_energy(predicted) * _energy(truth))
    product = np.abs(np.einsum("kas,kas->k", predicted.conj(), truth))
    return np.where(_energy(truth) > 0, product / np.where(norm > 0, norm, 1), np.nan)


def score_channels(
    predicted: Complex[np.ndarray, "K A S"],
    truth: Complex[np.ndarray, "K A S"],
    bandwidth: float | None,
    deviation: Float[np.ndarray, " K"] | None = None,
) -> dict[str, Any]:
    """Score predicted channels."""
    snr = snr_db(predicted, truth)
    heard = ~np.isnan(snr)
    if not heard.any():
        return {"rows": 0, **dict.fromkeys(SCORES)}
    predicted, truth, snr = predicted[heard], truth[heard], snr[heard]
    late = None
    if bandwidth is not None:
        late = 1e9 * float(np.median(np.abs(delay_spread(predicted, bandwidth) - delay_spread(truth, bandwidth))))
    return {
        "rows": int(heard.sum()),
        "snr_median_db": float(np.median(snr)),
        "snr_mean_db": float(snr.mean()),
        "snr_p10_db": float(np.quantile(snr, 0.1)),
        "correlation_median": float(np.median(correlation(predicted, truth))),
        "delay_spread_error_median_ns": late,
        "coverage_90": None if deviation is None else coverage(predicted - truth, deviation[heard]),
    }


def coverage(error: Complex[np.ndarray, "K A S"], deviation: Float[np.ndarray, " K"]) -> float:
    """Share of the real and imaginary parts of errors within the 90 % interval of a normal distribution."""
    bound = NORMAL * deviation[:, None, None]
    return float(np.mean([np.abs(error.real) <= bound, np.abs(error.imag) <= bound]))


def _energy(channels: Complex[np.ndarray, "K A S"]) -> Float[np.ndarray, " K"]:
    return np.square(np.abs(channels).astype(float)).sum(axis=(1, 2))
