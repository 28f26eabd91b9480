"""Scores of predicted responses over a band."""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import Complex

from learn.band.known_band import PredictedBand
from learn.channels.channel_scores import SCORES, correlation, coverage, snr_db
from simulate.spectra.band import delay_spread


def score_band(
    predicted: PredictedBand, truth: Complex[np.ndarray, "K elements subcarriers"], bandwidth: float
) -> dict[str, Any]:
    """Score predicted responses over a band."""
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
