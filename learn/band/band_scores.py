"""Scores of predicted responses over a band."""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import Complex

from learn.band.known_band import PredictedBand
from learn.channels.channel_scores import SCORES, correlation, coverage, snr_db
from simulate.spectra.delay_spread import delay_spread


def score_band(
    predicted: PredictedBand, truth: Complex[np.ndarray, "K elements subcarriers"], bandwidth: float
) -> dict[str, Any]:
    """Score predicted responses over a band.

    Args:
        predicted: the prediction.
        truth: true responses.
        bandwidth: number of the subcarriers times their distance, Hz.

    Returns:
        - "snr_median_db", "snr_mean_db" and "snr_p10_db" (10th percentile) of the signal-to-noise ratio
          10 log₁₀ ‖y‖² / ‖y − ŷ‖² over the positions, dB;
        - "correlation_median", of ``|ŷ^H y|`` / (‖ŷ‖ ‖y‖) over all elements and subcarriers of a position;
        - "delay_spread_error_median_ns", of the absolute error of the root mean square delay spread, ns;
        - "coverage_90", the share of the real and imaginary parts within the stated 90 % intervals; None if the method
          states none.

        Positions whose responses are zero do not count. All scores are None if there are no others.
    """
    snr = snr_db(predicted.responses, truth)
    heard = ~np.isnan(snr)
    if not heard.any():
        return dict.fromkeys(SCORES)
    found, truth, snr = predicted.responses[heard], truth[heard], snr[heard]
    off = np.abs(delay_spread(found, bandwidth) - delay_spread(truth, bandwidth))
    return {
        "snr_median_db": float(np.median(snr)),
        "snr_mean_db": float(snr.mean()),
        "snr_p10_db": float(np.quantile(snr, 0.1)),
        "correlation_median": float(np.median(correlation(found, truth))),
        "delay_spread_error_median_ns": 1e9 * float(np.median(off)),
        "coverage_90": None if predicted.deviation is None else coverage(found - truth, predicted.deviation[heard]),
    }
