"""The field of a scene from the solver, with its progress, and a sentence for the user that describes the runs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from rich.progress import Progress

from scenes.scene.description import SPEED_OF_LIGHT, Scene
from simulate.fullwave import OURS
from simulate.fullwave.all_elements import stored_field
from simulate.fullwave.memory import memory_of_runs, runs_at_once
from simulate.fullwave.run_plan import Plan
from simulate.fullwave.stored_field import StoredField
from simulate.fullwave.yee_grid import dispersion_residual


def solve(
    scene: Scene,
    planned: Plan,
    folder: Path,
    solver: str,
    workers: int | None,
    ray: str | None,
    gpu: bool,
    progress: Progress,
) -> StoredField:
    """The field of all elements. The same call again continues an interrupted one."""
    count = scene.gateway.count
    at_once = workers or runs_at_once(planned, count)
    ours_here = solver == OURS and ray is None
    progress.console.print(description(scene, planned, min(at_once, count) if ours_here else None))
    bar = progress.add_task("full wave", total=count)
    done = [0.0] * count

    def report(element: int, step: int) -> None:
        done[element] = step / planned.steps
        progress.update(bar, completed=sum(done))

    field = stored_field(scene, planned, folder, at_once, solver, gpu, ray, report)
    progress.update(bar, completed=count)
    return field


def _time(minutes: float) -> str:
    return f"{minutes:.2g} minutes" if minutes < 90 else f"{minutes / 60:.2g} hours"


def description(scene: Scene, planned: Plan, at_once: int | None) -> str:
    """A sentence for the user on the runs, and on what coarser cells would change."""
    further = [] if planned.band is None else planned.band.solved.tolist()
    cell, wavelength = planned.grid.cell, SPEED_OF_LIGHT / max([scene.frequency, *further])
    coarser = 1.25 * cell
    diagonal = float(np.linalg.norm(np.diff(scene.extent, axis=0)))
    count = scene.gateway.count

    def errors(cell: float) -> str:
        residual = dispersion_residual(wavelength, cell)
        return (
            f"{100 * residual:.2f} % and phases over {diagonal:.1f} m to {360 * residual * diagonal / wavelength:.0f}°"
        )

    cost = ""
    if at_once is not None:
        minutes, memory = planned.seconds / 60 * count / at_once, memory_of_runs(planned, count, at_once)
        cost = (
            f"{memory / 1e9:.2g} GB and at most about {_time(minutes)} on {at_once} core{'s' * (at_once > 1)}; "
            f"{_time(minutes / 1.25**4)} with cells of {1e3 * coarser:.3g} mm; "
        )
    return (
        f"full wave: {planned.grid.cells / 1e6:.1f} million cells of {1e3 * cell:g} mm, at most {planned.steps} time "
        f"steps for each of {count} elements; {cost}wavelengths are right to {errors(cell)}, with cells of "
        f"{1e3 * coarser:.3g} mm to {errors(coarser)}"
    )
