"""Figures of an evaluation of received powers."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np

from learn.powers.power_comparison import PowerComparison
from learn.reports.figures import MapScore, draw_error_map
from learn.reports.plots import MAGNITUDE
from learn.reports.provenance import Provenance

WORST = 95
"""Percentile of the errors at which the colour scale ends."""


def draw_power_figures(comparison: PowerComparison, model: str, folder: Path, made: Provenance) -> dict[str, str]:
    """Draw error_map.png (and .pdf): the median error of all gateways at each test position."""
    dataset, parts, errors = comparison.dataset, comparison.parts, comparison.errors[model]
    captions = {"error_cdf": "Distribution of the absolute errors, all gateways together."}
    heard = ~np.isnan(errors).all(axis=1)
    if not heard.any():
        return captions
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        typical = np.nanmedian(errors[heard], axis=1)
    ends = float(np.percentile(typical, WORST)) or 1.0
    score = MapScore(typical, (0.0, ends), "median error of the gateways (dB)", f"{MAGNITUDE}_r")
    draw_error_map(
        dataset.positions[parts.test][heard],
        [score],
        dataset.positions[parts.known],
        folder / "error_map.png",
        made,
    )
    captions["error_map"] = f"Where {model} errs: the median error of all gateways at each test position."
    return captions
