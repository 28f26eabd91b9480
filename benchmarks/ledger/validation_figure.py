"""A figure of learning curves: the validation SSIM over the steps of trainings."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path


def draw(axes: Mapping[str, Mapping[str, Path]], path: Path) -> None:
    """Draw the validation SSIM of every training."""
    # These imports take seconds, which --help need not wait for.
    from matplotlib.figure import Figure

    from learn.reports.comparison_report import validation_curve

    figure = Figure(figsize=(5 * len(axes), 4.2), layout="constrained")
    for axis, (title, runs) in zip(figure.subplots(1, len(axes), squeeze=False)[0], axes.items(), strict=True):
        for label, run in runs.items():
            axis.plot(*validation_curve(run), "o-", ms=3, label=label)
        axis.set(title=title, xlabel="training steps", ylabel="median SSIM on the validation part")
        axis.grid(alpha=0.3)
        axis.legend(fontsize="small")
    figure.savefig(path, dpi=120)
