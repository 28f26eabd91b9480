"""One picture of the floor plans of several scenes."""

from __future__ import annotations

from collections.abc import Mapping
from io import BytesIO
from pathlib import Path

import numpy as np

from scenes.drawing.floor_plan import draw_plan
from scenes.files.atomic import write_atomically
from scenes.files.plain_text import in_figure
from scenes.scene.description import Scene

ACROSS, INCHES, MOST = 5, 3.2, 40
"""Plans in a row, size of a plan in inches, and the largest number of plans that are drawn."""


def draw_plans(scenes: Mapping[str, Scene], path: Path) -> None:
    """Draw floor plans beside each other, as ``draw_scene`` draws them, the first ``MOST`` of them.

    Args:
        scenes: scenes by the titles of their plans.
        path: the PNG. An existing file is replaced.
    """
    from matplotlib.figure import Figure

    shown = dict(list(scenes.items())[:MOST])
    columns = min(ACROSS, len(shown))
    rows = -(-len(shown) // columns)
    figure = Figure(figsize=(INCHES * columns, INCHES * rows), dpi=90, layout="constrained")
    axes = np.atleast_1d(figure.subplots(rows, columns)).ravel()
    for axis, (title, scene) in zip(axes, shown.items(), strict=False):
        draw_plan(axis, scene)
        axis.set(title=in_figure(title), xlabel="", ylabel="")
        axis.tick_params(labelsize=7)
    for axis in axes[len(shown) :]:
        axis.remove()
    content = BytesIO()
    figure.savefig(content, format="png")
    write_atomically(path, content.getbuffer())
