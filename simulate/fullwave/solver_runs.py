"""Solver runs for some elements each."""

from __future__ import annotations

import math
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np

from scenes.scene.description import Scene
from simulate.fullwave import OURS
from simulate.fullwave.cells import EdgeMaterials
from simulate.fullwave.element_fields import element_field_by_gprmax, element_fields
from simulate.fullwave.gprmax import write_geometry
from simulate.fullwave.run_plan import Plan
from simulate.fullwave.stored_field import StoredField

MOST_AT_ONCE = 8
"""Most elements whose fields one run advances side by side (benchmarks/simulate/solvers.py)."""

Run = Callable[[list[int], Callable[[int], None]], list[StoredField]]
"""Runs the solver for some elements, and calls the given function with the number of finished time steps."""


def groups(numbers: list[int], at_once: int, solver: str = OURS) -> list[list[int]]:
    """Divide elements into runs of similar size, for some runs at a time. gprMax runs one element at a time.

    Example:
        >>> groups([0, 1, 2, 3, 4], 2)
        [[0, 1, 2], [3, 4]]
    """
    if solver != OURS:
        return [[number] for number in numbers]
    runs = at_once * math.ceil(len(numbers) / (at_once * MOST_AT_ONCE))
    return [part.tolist() for part in np.array_split(numbers, min(runs, len(numbers)))]


def run_of(solver: str, scene: Scene, planned: Plan, materials: EdgeMaterials, folder: Path, gpu: bool) -> Run:
    """The function that runs a solver. gprMax writes its files to the folder, which must be empty."""
    if solver == OURS:
        return lambda elements, told: element_fields(scene, planned, elements, materials, told)
    return _run_of_gprmax(scene, planned, materials, folder, gpu)


def _run_of_gprmax(scene: Scene, planned: Plan, materials: EdgeMaterials, folder: Path, gpu: bool) -> Run:
    """The function that runs gprMax, with its files in a folder."""
    geometry = folder / "geometry"
    geometry.mkdir()
    write_geometry(geometry, materials, planned.grid)

    def run(elements: list[int], told: Callable[[int], None]) -> list[StoredField]:
        fields = []
        for element in elements:
            working = folder / f"element-{element:03d}"
            working.mkdir()
            fields.append(element_field_by_gprmax(scene, planned, element, working, geometry, gpu, told))
            shutil.rmtree(working)
        return fields

    return run
