"""The command ``bisplat coverage``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from bisplat.commands.common_options import Force
from bisplat.commands.simulate_command import Output
from scenes.files.errors import printable
from scenes.files.output_folder import new_folder


def coverage(
    powers: Annotated[Positional[Path], arg(metavar="RSSI")],
    output: Output,
    height: float | None = None,
    step: float = 0.1,
    region: tuple[float, float, float, float] | None = None,
    method: str = "helmholtz",
    scene: str | None = None,
    force: Force = False,
) -> None:
    """Map the received powers (RSSI) of every gateway at a height.

    Writes arrays (coverage.npz) and figures, with 90 % intervals. Only the method twin traces rays; otherwise, walls
    count as far as the measured powers show them.

    Args:
        powers: folder of received powers. The method learns from all of its positions.
        output: the new folder.
        height: z of the map, metres (default: the median of the known positions).
        step: side of a cell, metres.
        region: smallest x and y, then largest x and y of the map, metres, within which every cell is predicted
            (default: the convex hull of the known positions).
        method: name of the method, as for bisplat compare.
        scene: scene whose walls are drawn, and which the method twin traces: a built-in name or a scene YAML (default,
            for the walls: that of the folder, if any).
    """
    from learn.fitted.coverage import coverage_map
    from learn.fitted.fit_powers import fit_powers
    from learn.methods.method_table import TWIN
    from learn.reports.coverage_report import write_coverage_files
    from learn.training.fit_progress import FitProgress
    from scenes.storage.scene_yaml import load_scene

    drawn = None if scene is None else load_scene(scene)
    with new_folder(output, force) as unfinished:
        fitted = fit_powers(powers, method, scene=drawn) if method == TWIN else powers
        with FitProgress("coverage") as report:
            found = coverage_map(fitted, height=height, step=step, region=region, method=method, report=report)
        write_coverage_files(found, unfinished, drawn)
    columns, rows = len(found.x), len(found.y)
    gateways = len(found.median)
    print(
        printable(
            f"{gateways} gateway{'s' * (gateways > 1)}, {columns} × {rows} cells of {found.step:g} m at "
            f"z = {found.height:.2f} m: {output}"
        )
    )
