"""Solver runs for some elements each, and the responses at every position of the region that follow from them."""

from __future__ import annotations

import math
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Complex

from scenes.checks.occupancy import element_positions
from scenes.scene.description import SPEED_OF_LIGHT
from scenes.scene.materials import VACUUM_PERMEABILITY
from simulate.fullwave import OURS
from simulate.fullwave.cells import EdgeMaterials, edge_materials
from simulate.fullwave.dipole import GAIN, Source, element_direction, transmitter_direction
from simulate.fullwave.gprmax import run, write_geometry
from simulate.fullwave.leapfrog import cells_at_rest
from simulate.fullwave.run_plan import Plan
from simulate.fullwave.solver import looks, solve, still_to_come
from simulate.fullwave.stored_field import LOST, FieldBand, StoredField, undo_mean_of_edges
from simulate.fullwave.yee_grid import numerical_frequency


def element_fields(
    planned: Plan,
    numbers: list[int],
    materials: EdgeMaterials,
    report: Callable[[int], None] = lambda step: None,
) -> list[StoredField]:
    """Run our solver for some elements together, at the scene's frequency and at the further ones of the plan.

    The response is

        y_m = 1.5 λ / (−jωμ₀) · E_m·q / Iℓ,

    with the field E_m of a dipole of moment Iℓ at element m, and the direction q of the transmitter's dipole. Then
    ``|y_m|²`` is the channel gain, as the ray tracer's between two "dipole" antennas.
    """
    scene, grid, band = planned.scene, planned.grid, planned.band
    sources = [element_source(planned, number) for number in numbers]
    cells = cells_at_rest(materials, grid, len(sources))
    wanted = [scene.frequency, *([] if band is None else band.solved)]
    on_grid = np.array([numerical_frequency(SPEED_OF_LIGHT / each, grid.cell) for each in wanted])
    axes = [axis for axis, share in enumerate(transmitter_direction(scene)) if share]
    watched, ends = 1 if band is None else band.watched, (planned.steps, planned.earliest)
    found = []
    for field in solve(cells, grid, sources, on_grid, axes, planned.box, *ends, watched, report):
        first, *further = (
            _in_region(planned, phasor, field.unsettled, field.steps, frequency, driven)
            for phasor, frequency, driven in zip(field.phasors, wanted, on_grid, strict=True)
        )
        if band is not None:
            values = np.stack([part.values for part in further])
            first = replace(first, band=FieldBand(band.solved, band.frequencies, band.delay, values))
        found.append(first)
    return found


def element_source(planned: Plan, number: int) -> Source:
    scene = planned.scene
    position = element_positions(scene.gateway, scene.wavelength)[number]
    return Source(position, element_direction(scene), planned.frequency)


def _in_region(
    planned: Plan,
    phasor: Complex[np.ndarray, "3 nx ny nz"],
    unsettled: float,
    steps: int,
    frequency: float,
    driven: float,
) -> StoredField:
    """The response of one element, from the field at the middles of cells, driven at a frequency on the grid."""
    direction = transmitter_direction(planned.scene)
    along = sum(share * undo_mean_of_edges(phasor[axis], axis) for axis, share in enumerate(direction) if share)
    factor = GAIN * SPEED_OF_LIGHT / frequency / (-2j * np.pi * driven * VACUUM_PERMEABILITY)
    grid, inner = planned.grid, slice(LOST, -LOST)
    return StoredField(
        np.asarray(grid.origin) + grid.cell * (planned.box[0] + LOST + 0.5),
        grid.cell,
        (factor * along)[None, inner, inner, inner].astype(np.complex64),
        np.array([unsettled]),
        steps,
    )


MOST_AT_ONCE = 8
"""Most elements whose fields one run advances side by side (benchmarks/simulate/solvers.py)."""

Run = Callable[[list[int], Callable[[int], None]], list[StoredField]]
"""Runs the solver for some elements, and calls the given function with the number of finished time steps."""


def groups(numbers: list[int], at_once: int, solver: str = OURS) -> list[list[int]]:
    """Divide elements into runs of similar size, for some runs at a time. gprMax runs one element at a time."""
    if solver != OURS:
        return [[number] for number in numbers]
    runs = at_once * math.ceil(len(numbers) / (at_once * MOST_AT_ONCE))
    return [part.tolist() for part in np.array_split(numbers, min(runs, len(numbers)))]


def run_of(solver: str, planned: Plan, folder: Path, gpu: bool) -> Run:
    """The function that runs a solver. gprMax writes its files to the folder, which must be empty."""
    materials = edge_materials(planned.scene, planned.grid)
    if solver == OURS:
        return lambda elements, told: element_fields(planned, elements, materials, told)
    geometry = folder / "geometry"
    geometry.mkdir()
    write_geometry(geometry, materials, planned.grid)
    ends, box = looks(planned.steps)[-3:], planned.box

    def by_gprmax(elements: list[int], told: Callable[[int], None]) -> list[StoredField]:
        fields = []
        for element in elements:
            working = folder / f"element-{element:03d}"
            working.mkdir()
            source = element_source(planned, element)
            found = run(working, geometry, planned.grid, source, box, ends, gpu, told)
            rest, frequencies = still_to_come(*found), (planned.scene.frequency, planned.frequency)
            fields.append(_in_region(planned, found[-1], rest, planned.steps, *frequencies))
            shutil.rmtree(working)
        return fields

    return by_gprmax
