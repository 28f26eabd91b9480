"""The figure of ``bisplat compare`` for received powers and for channels: how the scores of each method spread."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from jaxtyping import Float
from matplotlib.figure import Figure

from learn.reports.paper import COLUMN, at_paper_size, save
from learn.reports.plots import plot_cdf
from learn.reports.provenance import Provenance


@at_paper_size()
def draw_score_distribution(
    scores: Mapping[str, Float[np.ndarray, "..."]],
    label: str,
    share: str,
    path: Path,
    made: Provenance,
    percentile: float | None = None,
) -> None:
    """Draw the cumulative distribution of the scores of each method."""
    stated = {name: each[~np.isnan(each)] for name, each in scores.items()}
    figure = Figure(figsize=(COLUMN, 2.3 + 0.15 * len(stated)), layout="constrained")
    axis = figure.subplots()
    if all(each.size for each in stated.values()):
        plot_cdf(stated, axis, label)
        if percentile is not None:
            axis.set_xlim(0, max(float(np.percentile(each, percentile)) for each in stated.values()) or 1)
        figure.legend(loc="outside upper left", handlelength=3.2)
    axis.set_ylabel(share)
    save(figure, path, made)
