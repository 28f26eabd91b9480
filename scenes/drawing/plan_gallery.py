"""One picture of the floor plans of several scenes, with a legend of their materials."""

from __future__ import annotations

from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from scenes.drawing.floor_plan import REGION, draw_plan
from scenes.files.atomic import write_atomically
from scenes.files.plain_text import in_figure
from scenes.scene.description import Scene

ACROSS, INCHES, MOST = 5, 3.2, 40
"""Plans in a row, size of a plan in inches, and the largest number of plans that are drawn."""


def draw_plans(scenes: Mapping[str, Scene], path: Path) -> None:
    """Draw the floor plans of the first ``MOST`` scenes beside each other, as ``draw_scene`` does but without numbers.

    Lengths are in metres. The legend has the materials of all plans, and the marks of regions and gateways.
    """
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

    shown = dict(list(scenes.items())[:MOST])
    columns = min(ACROSS, len(shown))
    rows = -(-len(shown) // columns)
    wide = max(2, columns)  # as the legend is
    figure = Figure(figsize=(INCHES * wide, INCHES * rows), dpi=90, layout="constrained")
    axes = np.atleast_1d(figure.subplots(rows, columns)).ravel()
    for axis, (title, scene) in zip(axes, shown.items(), strict=False):
        draw_plan(axis, scene, numbered=False)
        axis.set(title=in_figure(title), xlabel="", ylabel="")
        axis.tick_params(labelsize=7)
    for axis in axes[len(shown) :]:
        axis.remove()
    materials = {name: material.color for scene in shown.values() for name, material in scene.materials.items()}
    handles: list[Any] = [
        Patch(facecolor=color, edgecolor="0.3", label=in_figure(name)) for name, color in materials.items()
    ]
    doors = {label: line for axis in figure.axes for line, label in zip(*axis.get_legend_handles_labels(), strict=True)}
    handles += [*doors.values(), Patch(facecolor=REGION, edgecolor="green", label="transmitter region")]
    handles.append(Patch(facecolor="crimson", label="gateway and boresight"))
    figure.legend(handles=handles, loc="outside lower center", ncols=2 * wide, frameon=False, fontsize=9)
    content = BytesIO()
    figure.savefig(content, format="png")
    write_atomically(path, content.getbuffer())
