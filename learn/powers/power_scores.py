"""Scores of predicted powers."""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import Float

from learn.powers.known_powers import PredictedPowers


def absolute_errors(predicted: PredictedPowers, truth: Float[np.ndarray, "K G"]) -> Float[np.ndarray, "K G"]:
    """Absolute error of each power, dB; NaN where nothing was received, since no error in dB is known there."""
    return np.abs(predicted.median - truth)


def score_powers(predicted: PredictedPowers, truth: Float[np.ndarray, "K G"], floor: float) -> dict[str, Any]:
    """Score predicted powers, all gateways together.

    Example:
        >>> truth = np.array([[-60.0], [-70.0], [np.nan]])
        >>> found = score_powers(PredictedPowers(np.array([[-61.0], [-67.0], [-99.0]])), truth, floor=-95.0)
        >>> found["error_median_db"], found["received_rightly"], found["not_received"], found["coverage_90"]
        (2.0, 1.0, 1, None)
    """
    heard = ~np.isnan(truth)
    errors = absolute_errors(predicted, truth)[heard]
    row: dict[str, Any] = {
        "powers": int(heard.sum()),
        "not_received": int((~heard).sum()),
        "error_median_db": float(np.median(errors)) if errors.size else None,
        "error_p90_db": float(np.quantile(errors, 0.9)) if errors.size else None,
        "rmse_db": float(np.sqrt(np.square(errors).mean())) if errors.size else None,
        "received_rightly": float(((predicted.median >= floor) == heard).mean()),
        "coverage_90": None,
        "interval_median_db": None,
    }
    if predicted.low is not None and predicted.high is not None and errors.size:
        within = (predicted.low <= truth) & (truth <= predicted.high)
        row["coverage_90"] = float(within[heard].mean())
        row["interval_median_db"] = float(np.median((predicted.high - predicted.low)[heard]))
    return row


def of_gateway(predicted: PredictedPowers, gateway: int) -> PredictedPowers:
    """The predictions of one gateway."""
    parts = (predicted.median, predicted.low, predicted.high)
    return PredictedPowers(*(None if each is None else each[:, [gateway]] for each in parts))  # type: ignore[arg-type]
