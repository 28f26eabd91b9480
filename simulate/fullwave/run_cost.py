"""What full-wave runs cost in memory and time, and whether this machine can carry them."""

from __future__ import annotations

import os

import numpy as np

from scenes.files.errors import InputError, ParameterError
from scenes.scene.description import SPEED_OF_LIGHT
from simulate.fullwave.element_fields import groups
from simulate.fullwave.run_plan import Plan, plan
from simulate.fullwave.yee_grid import dispersion_residual
from simulate.parallel.machines import machine_memory

LARGER = 1.1  # Step in the search for cells that fit


def memory_of_runs(planned: Plan, at_once: int) -> int:
    elements = planned.scene.gateway.count
    runs = min(at_once, elements)
    return runs * planned.memory(len(groups(list(range(elements)), runs)[0]))


def runs_at_once(planned: Plan) -> int:
    """Number of runs at a time for which this machine has cores and memory, at least one."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(_fitting(planned, cores), 1)


def _fitting(planned: Plan, most: int) -> int:
    """Largest number of runs at a time that fit in memory; 0 if not even one does."""
    memory, numbers = machine_memory(), range(1, min(most, planned.scene.gateway.count) + 1)
    return max((number for number in numbers if memory_of_runs(planned, number) < memory), default=0)


def require_memory(planned: Plan, workers: int | None = None) -> None:
    """Refuse runs of our solver for which this machine has too little memory, before they start."""
    fitting, memory = _fitting(planned, workers or 1), machine_memory()
    if fitting >= min(workers or 1, planned.scene.gateway.count):
        return
    needed = memory_of_runs(planned, workers if workers and fitting else 1)
    takes = f"{needed / 1e9:.3g} GB of memory, and this machine has {memory / 1e9:.3g} GB"
    if fitting:
        raise ParameterError("workers", f"expected at most {fitting}, since {workers} runs take {takes}")
    cell, larger = planned.grid.cell, _cells_that_fit(planned)
    if larger is not None:
        raise ParameterError("cell", f"expected about {larger:g} m, since cells of {cell:g} m take {takes}")
    raise InputError(
        f"{planned.scene.name}: expected a smaller scene, or a Ray cluster of larger machines (--ray ADDRESS), since "
        f"its {planned.grid.cells / 1e6:.3g} million cells take {takes}, and the waves need such cells"
    )


def _cells_that_fit(planned: Plan) -> float | None:
    """Side of larger cells for which the memory suffices, metres; None if the waves need smaller ones."""
    cell = planned.grid.cell
    while True:
        cell = float(f"{LARGER * cell:.2g}")
        try:
            if _fitting(plan(planned.scene, planned.region, cell), 1):
                return cell
        except ParameterError:
            return None


def _time(minutes: float) -> str:
    return f"{minutes:.2g} minutes" if minutes < 90 else f"{minutes / 60:.2g} hours"


def description(planned: Plan, at_once: int | None) -> str:
    """A sentence for the user on the runs, and on what coarser cells would change."""
    scene, further = planned.scene, [] if planned.band is None else planned.band.solved.tolist()
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
        minutes, memory = planned.seconds / 60 * count / at_once, memory_of_runs(planned, at_once)
        cost = (
            f"{memory / 1e9:.2g} GB and at most about {_time(minutes)} on {at_once} core{'s' * (at_once > 1)}; "
            f"{_time(minutes / 1.25**4)} with cells of {1e3 * coarser:.3g} mm; "
        )
    return (
        f"full wave: {planned.grid.cells / 1e6:.1f} million cells of {1e3 * cell:g} mm, at most {planned.steps} time "
        f"steps for each of {count} elements; {cost}wavelengths are right to {errors(cell)}, with cells of "
        f"{1e3 * coarser:.3g} mm to {errors(coarser)}"
    )
