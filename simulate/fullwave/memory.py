"""The memory of this machine, and how many solver runs fit in it at a time."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

import numpy as np
from jaxtyping import Float

from scenes.files.errors import InputError, ParameterError
from scenes.scene.description import Scene
from simulate.fullwave.run_plan import Plan, plan
from simulate.fullwave.solver_runs import groups

LIMITS = ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes")
"""Files in which Linux states the limit of a container."""

LARGER = 1.1
"""Step in the search for cells that fit."""


def machine_memory() -> float:
    """Bytes of memory of this machine, or of the container if it may take less; infinite if they are not known."""
    known = [float("inf")]
    if hasattr(os, "sysconf"):
        known.append(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    for file in LIMITS:
        with suppress(OSError, ValueError):  # there is no such file, or it says "max"
            known.append(int(Path(file).read_text()))
    return min(known)


def memory_of_runs(planned: Plan, elements: int, at_once: int) -> int:
    """Bytes that some runs at a time take."""
    runs = min(at_once, elements)
    return runs * planned.memory(len(groups(list(range(elements)), runs)[0]))


def runs_at_once(planned: Plan, elements: int) -> int:
    """Number of runs at a time for which this machine has cores and memory, at least one."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(_fitting(planned, elements, cores), 1)


def _fitting(planned: Plan, elements: int, most: int) -> int:
    """Largest number of runs at a time that fit in memory; 0 if not even one does."""
    memory, numbers = machine_memory(), range(1, min(most, elements) + 1)
    return max((number for number in numbers if memory_of_runs(planned, elements, number) < memory), default=0)


def require_memory(scene: Scene, region: Float[np.ndarray, "2 3"], planned: Plan, workers: int | None = None) -> None:
    """Refuse runs of our solver for which this machine has too little memory, before they start."""
    elements, memory = scene.gateway.count, machine_memory()
    fitting = _fitting(planned, elements, workers or 1)
    if fitting >= min(workers or 1, elements):
        return
    needed = memory_of_runs(planned, elements, workers if workers and fitting else 1)
    takes = f"{needed / 1e9:.3g} GB of memory, and this machine has {memory / 1e9:.3g} GB"
    if fitting:
        raise ParameterError("workers", f"expected at most {fitting}, since {workers} runs take {takes}")
    cell, larger = planned.grid.cell, _cells_that_fit(scene, region, planned.grid.cell)
    if larger is not None:
        raise ParameterError("cell", f"expected about {larger:g} m, since cells of {cell:g} m take {takes}")
    raise InputError(
        f"{scene.name}: expected a smaller scene, or a Ray cluster of larger machines (--ray ADDRESS), since its "
        f"{planned.grid.cells / 1e6:.3g} million cells take {takes}, and the waves need such cells"
    )


def _cells_that_fit(scene: Scene, region: Float[np.ndarray, "2 3"], cell: float) -> float | None:
    """Side of larger cells for which the memory suffices, metres; None if the waves need smaller ones."""
    elements = scene.gateway.count
    while True:
        cell = float(f"{LARGER * cell:.2g}")
        try:
            if _fitting(plan(scene, region, cell), elements, 1):
                return cell
        except ParameterError:
            return None
