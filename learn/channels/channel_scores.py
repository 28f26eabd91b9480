"""Scores of predicted channels."""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import Complex, Float

MOST_SNR_DB = 200.0
"""Largest SNR that is stated. A prediction without any error gets it."""


def snr_db(predicted: Complex[np.ndarray, "K A S"], truth: Complex[np.ndarray, "K A S"]) -> Float[np.ndarray, " K"]:
    """Signal-to-noise ratio of each row's prediction, 10 log₁₀ ‖h‖² / ‖h − ĥ‖², dB, as NeRF² defines it [zhao2023].

    It is 0 dB if zeros are predicted, and negative for worse predictions. It is NaN for a link of zeros.

    Args:
        predicted: predicted channels ĥ.
        truth: measured channels h.

    Example:
        >>> snr_db(np.array([[[0.9, 1.0]]]), np.array([[[1.0, 1.0]]])).round(1).tolist()
        [23.0]
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

    Args:
        predicted: predicted channels ĥ.
        truth: measured channels h.

    Example:
        >>> correlation(np.array([[[3.0j, 4.0j]]]), np.array([[[1.0, 0.0]]])).round(1).tolist()
        [0.6]
    """
    norm = np.sqrt(_energy(predicted) * _energy(truth))
    product = np.abs(np.einsum("kas,kas->k", predicted.conj(), truth))
    return np.where(_energy(truth) > 0, product / np.where(norm > 0, norm, 1), np.nan)


def score_channels(predicted: Complex[np.ndarray, "K A S"], truth: Complex[np.ndarray, "K A S"]) -> dict[str, Any]:
    """Score predicted channels.

    Args:
        predicted: predicted channels of the downlink.
        truth: measured ones.

    Returns:
        - "rows": number of rows that the scores refer to, those whose downlink is not zero;
        - "snr_median_db", "snr_mean_db" and "snr_p10_db" (10th percentile) of the SNR in dB over the rows; None if
          there is no such row;
        - "correlation_median": of the correlation.
    """
    snr = snr_db(predicted, truth)
    heard = ~np.isnan(snr)
    if not heard.any():
        names = ("snr_median_db", "snr_mean_db", "snr_p10_db", "correlation_median")
        return {"rows": 0, **dict.fromkeys(names)}
    return {
        "rows": int(heard.sum()),
        "snr_median_db": float(np.median(snr[heard])),
        "snr_mean_db": float(snr[heard].mean()),
        "snr_p10_db": float(np.quantile(snr[heard], 0.1)),
        "correlation_median": float(np.median(correlation(predicted[heard], truth[heard]))),
    }


def _energy(channels: Complex[np.ndarray, "K A S"]) -> Float[np.ndarray, " K"]:
    return np.square(np.abs(channels).astype(float)).sum(axis=(1, 2))
