"""The response of one element at every position of the region: one run of the solver."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from jaxtyping import Complex

from scenes.array_clearance import element_positions
from scenes.description import Scene
from simulate.fullwave.dipole import GAIN, element_direction, transmitter_direction
from simulate.fullwave.gprmax import Source, run
from simulate.fullwave.plan import Plan
from simulate.fullwave.stored_field import LOST, StoredField, undo_mean_of_edges

VACUUM_PERMEABILITY = 1.25663706212e-6
"""μ₀, henries per metre."""

SETTLED = 1e-3
"""A field that differs less from that at the end of the run, relative to it, has settled: its rest is 60 dB down."""


def element_field(
    scene: Scene,
    planned: Plan,
    number: int,
    steps: int | None,
    working: Path,
    geometry: Path,
    threads: int = 1,
    gpu: bool = False,
    report: Callable[[int, int], None] = lambda step, steps: None,
) -> StoredField:
    """Run the solver for one element.

    The response is

        y_m = 1.5 λ / (−jωμ₀) · E_m·q / Iℓ,

    E_m the field of a dipole of moment Iℓ at element m and q the transmitter's direction: |y_m|² is the channel gain,
    as the ray tracer's is between two "dipole" antennas.

    Args:
        scene: the scene.
        planned: the run.
        number: of the element.
        steps: number of time steps; None: as many as planned, to find after how many the field has settled
            (``SETTLED``), which the result tells.
        working: empty folder for the files of the run.
        geometry: folder with the files of ``write_geometry``.
        threads: of the solver; its result does not depend on them.
        gpu: run on an NVIDIA GPU.
        report: called with the number of time steps done, and of all.

    Raises:
        InputError: the solver failed.
    """
    position = element_positions(scene.gateway, scene.wavelength)[number]
    source = Source(position, element_direction(scene), planned.frequency)
    # Look back by a twentieth of the planned run, and the first element's run by many of them.
    ends = [planned.steps * twentieth // 20 for twentieth in range(6, 21)]
    if steps is not None:
        ends = [steps - planned.steps // 20, steps]
    fields = run(working, geometry, planned.grid, source, planned.box, ends, threads, gpu, report)
    last = max(float(np.linalg.norm(fields[-1])), 1e-300)
    changes = [float(np.linalg.norm(field - fields[-1])) / last for field in fields[:-1]]
    settled = [end for end, change in zip(ends, changes, strict=False) if change < SETTLED]
    return _in_region(scene, planned, fields[-1], changes[-1], settled[0] if steps is None and settled else ends[-1])


def _in_region(
    scene: Scene, planned: Plan, field: Complex[np.ndarray, "3 nx ny nz"], change: float, steps: int
) -> StoredField:
    """The response of one element, from the field at the middles of cells."""
    direction = transmitter_direction(scene)
    along = sum(share * undo_mean_of_edges(field[axis], axis) for axis, share in enumerate(direction) if share)
    factor = GAIN * scene.wavelength / (-2j * np.pi * planned.frequency * VACUUM_PERMEABILITY)
    grid = planned.grid
    inner = slice(LOST, -LOST)
    return StoredField(
        np.asarray(grid.origin) + grid.cell * (planned.box[0] + LOST + 0.5),
        grid.cell,
        (factor * along)[None, inner, inner, inner].astype(np.complex64),
        np.array([change]),
        steps,
    )
