"""The figures of ``bisplat engines``, and its numbers as JSON."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from learn.evaluation.engines import EngineComparison
from learn.evaluation.engines_plane import EnginePlane
from learn.reports.paper import PAGE, at_paper_size, save
from learn.reports.plots import MAGNITUDE
from learn.reports.provenance import Provenance
from scenes.files.atomic import write_atomically

FILES = ("engines.json", "engines_map.png", "engines_map.pdf", "engines_plane.png", "engines_plane.pdf")
"""Names of the files that ``bisplat engines`` writes."""

LARGEST_LEVEL = 6.0
"""The colour scale of level errors ends at ± this, dB."""

LOWEST, HIGHEST = -20.0, 5.0
"""Ends of the colour scale of levels and errors on the plane, dB."""


@at_paper_size()
def write_engines(compared: EngineComparison, folder: Path) -> None:
    """Write engines.json, and engines_map as PNG and PDF."""
    folder.mkdir(parents=True, exist_ok=True)
    write_atomically(folder / "engines.json", (json.dumps(compared.metrics(), indent=2) + "\n").encode())
    quantities = (
        (compared.correlation, "correlation", MAGNITUDE, 0.0, 1.0),
        (compared.scores.ssim, "SSIM", MAGNITUDE, 0.0, 1.0),
        (compared.level_error_db, "rays' level over full wave's (dB)", "coolwarm", -LARGEST_LEVEL, LARGEST_LEVEL),
    )
    figure = Figure(figsize=(PAGE, 4.6), layout="constrained")
    axes = figure.subplots(2, 3)
    for column, (values, label, colours, low, high) in zip(axes.T, quantities, strict=True):
        for axis, (first, second) in zip(column, ((0, 1), (0, 2)), strict=True):
            points = axis.scatter(
                compared.positions[:, first],
                compared.positions[:, second],
                c=values,
                s=10,
                cmap=colours,
                vmin=low,
                vmax=high,
            )
            axis.set(xlabel=f"{'xyz'[first]} (m)", ylabel=f"{'xyz'[second]} (m)", aspect="equal")
        figure.colorbar(
            points, ax=column, label=label, orientation="horizontal", extend="both" if low < 0 else "neither"
        )
    axes[0, 0].set_title("from above")
    axes[1, 0].set_title("from the side")
    title = f"Rays against the full wave of {compared.name} at {len(compared.positions)} positions"
    save(figure, folder / "engines_map.png", Provenance(title, "rays", compared.name))


@at_paper_size()
def draw_plane(plane: EnginePlane, folder: Path) -> None:
    """Draw the full wave's level and the rays' errors as engines_plane, PNG and PDF.

    White lines show where direct or once reflected paths to the array's middle element end.
    """
    errors = {f"error of rays, depth {depth}": values for depth, values in plane.errors_db.items()}
    panels = {"full wave": plane.level_db, **errors}
    figure = Figure(figsize=(PAGE, 2.6), layout="constrained")
    axes = figure.subplots(1, len(panels), sharey=True)
    for axis, (title, values) in zip(axes, panels.items(), strict=True):
        image = axis.pcolormesh(plane.x, plane.y, values, vmin=LOWEST, vmax=HIGHEST, cmap=MAGNITUDE, shading="nearest")
        borders = np.arange(plane.paths.min(), plane.paths.max()) + 0.5
        if len(borders) and min(plane.paths.shape) > 1:  # a region can be a line
            axis.contour(plane.x, plane.y, plane.paths, levels=borders, colors="white", linewidths=1)
        axis.set(title=title, xlabel="x (m)", aspect="equal")
    axes[0].set_ylabel("y (m)")
    figure.colorbar(image, ax=axes, label=f"dB over full wave's mean at z = {plane.z:g} m", extend="both")
    title = f"Rays against the full wave of {plane.name} at z = {plane.z:g} m"
    save(figure, folder / "engines_plane.png", Provenance(title, "rays", plane.name))
