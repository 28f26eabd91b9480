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
    """Draw the cumulative distribution of the scores of each method.

    Args:
        scores: scores by name of the method; NaN where there is none.
        label: what a score is, with its unit.
        share: what the shares are of.
        path: path of the PNG; the PDF has the same name with the suffix .pdf.
        made: where the figure comes from.
        percentile: percentile of the worst method's scores at which the axis ends; it then begins at 0. None: the axis
            holds all scores.
    """
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
