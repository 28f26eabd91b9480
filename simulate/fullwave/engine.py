"""The full-wave engine: one run of the solver per element, kept as they end, then the stored field of all."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from jaxtyping import Complex, Float
from scipy.spatial.transform import Rotation

from scenes.array_clearance import element_positions
from scenes.description import SPEED_OF_LIGHT, Scene
from simulate.fullwave.cells import edge_materials
from simulate.fullwave.gprmax import Source, installed_solver, run, write_geometry
from simulate.fullwave.plan import Plan
from simulate.fullwave.stored_field import StoredField, at_cell_middles_to_edges, read_stored_field

VACUUM_PERMEABILITY = 1.25663706212e-6
"""μ₀, henries per metre."""

WORKING = "running-"
"""Beginning of the names of folders that runs work in."""

SETTLED = 1e-3
"""A field that differs less from that at the end of the run, relative to it, has settled: its rest is 60 dB down."""

DIPOLE_GAIN = 1.5
"""Gain of a short dipole."""


def element_direction(scene: Scene) -> Float[np.ndarray, " 3"]:
    """Direction of the gateway's dipoles: of its y axis ("V") or x axis ("H"); unit vector, world frame."""
    axis = [0.0, 1.0, 0.0] if scene.gateway.polarization == "V" else [1.0, 0.0, 0.0]
    return Rotation.from_quat(scene.gateway.orientation).apply(axis)


def transmitter_direction(scene: Scene) -> Float[np.ndarray, " 3"]:
    """Direction of the transmitter's dipole: of its z axis ("V") or y axis ("H"); unit vector, world frame."""
    axis = [0.0, 0.0, 1.0] if scene.transmitter.polarization == "V" else [0.0, 1.0, 0.0]
    return Rotation.from_quat(scene.transmitter.orientation).apply(axis)


def stored_field(
    scene: Scene,
    planned: Plan,
    folder: Path,
    at_once: int = 1,
    report: Callable[[int, int, int, int], None] = lambda element, elements, step, steps: None,
) -> StoredField:
    """The responses of all elements in the region, from one run each; the same call again continues an interrupted one.

    Elements and transmitter are short dipoles, whatever antennas the scene names. The response is

        y_m = 1.5 λ / (−jωμ₀) · E_m·q / Iℓ,

    E_m the field of a dipole of moment Iℓ at element m and q the transmitter's direction: |y_m|² is the channel gain,
    as the ray tracer's is between two "dipole" antennas.

    The first element's run has as many steps as planned, and tells after how many its field had settled
    (``SETTLED``); the other runs end there.

    Args:
        scene: the scene.
        planned: the runs.
        folder: keeps ``element-NNN.npz`` of each run that has ended.
        at_once: number of runs at a time, on one core each.
        report: called with the element's number, the number of elements, and of time steps done and in all.

    Raises:
        InputError: gprMax is not installed, or it failed.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for left in folder.glob(f"{WORKING}*"):  # by a run that was killed
        shutil.rmtree(left)
    count = len(element_positions(scene.gateway, scene.wavelength))
    missing = [number for number in range(count) if not _file(folder, number).exists()]
    if missing:
        installed_solver()  # or an error, before anything is written
        with tempfile.TemporaryDirectory(dir=folder, prefix=WORKING) as geometry:
            write_geometry(Path(geometry), edge_materials(scene, planned.grid), planned.grid)
            if 0 in missing:
                _run_element(scene, planned, planned.steps, 0, folder, Path(geometry), partial(report, 0, count))
            steps = read_stored_field(_file(folder, 0)).steps
            with ThreadPoolExecutor(at_once) as pool:
                runs = [
                    pool.submit(
                        _run_element, scene, planned, steps, number, folder, Path(geometry),
                        partial(report, number, count),
                    )
                    for number in missing
                    if number > 0
                ]  # fmt: skip
                try:
                    for done in as_completed(runs):
                        done.result()
                except BaseException:
                    pool.shutdown(cancel_futures=True)
                    raise
    parts = [read_stored_field(_file(folder, number)) for number in range(count)]
    return replace(
        parts[0],
        values=np.concatenate([part.values for part in parts]),
        unsettled=np.concatenate([part.unsettled for part in parts]),
    )


def _run_element(
    scene: Scene,
    planned: Plan,
    steps: int,
    number: int,
    folder: Path,
    geometry: Path,
    report: Callable[[int, int], None],
) -> None:
    """Run one element and write its responses."""
    source = Source(
        element_positions(scene.gateway, scene.wavelength)[number], element_direction(scene), planned.frequency
    )
    # The first run looks back in steps of a twentieth of its end, the others to the last two periods.
    period = 1 / (planned.frequency * planned.grid.time_step)
    ends = (
        [steps * twentieth // 20 for twentieth in range(6, 21)] if number == 0 else [steps - round(2 * period), steps]
    )
    with tempfile.TemporaryDirectory(dir=folder, prefix=WORKING) as working:
        fields = run(Path(working), geometry, planned.grid, source, planned.box, ends, report)
    last = float(np.linalg.norm(fields[-1]))
    changes = [float(np.linalg.norm(field - fields[-1])) / max(last, 1e-300) for field in fields[:-1]]
    settled = [end for end, change in zip(ends, changes, strict=False) if change < SETTLED]
    part = _one_element(scene, planned, fields[-1], changes[-1], settled[0] if number == 0 and settled else steps)
    part.write(_file(folder, number))


def _file(folder: Path, number: int) -> Path:
    return folder / f"element-{number:03d}.npz"


def _one_element(
    scene: Scene, planned: Plan, field: Complex[np.ndarray, "3 nx ny nz"], change: float, steps: int
) -> StoredField:
    """The response of one element, from the field at the middles of cells."""
    direction = transmitter_direction(scene)
    along = sum(share * at_cell_middles_to_edges(field[axis], axis) for axis, share in enumerate(direction) if share)
    factor = DIPOLE_GAIN * scene.wavelength / (-2j * np.pi * planned.frequency * VACUUM_PERMEABILITY)
    grid = planned.grid
    inner = slice(2, -2)  # second differences need two neighbours
    return StoredField(
        np.asarray(grid.origin) + grid.cell * (planned.box[0] + 2.5),
        grid.cell,
        (factor * along)[None, inner, inner, inner].astype(np.complex64),
        np.array([change]),
        steps,
    )


def free_space_response(
    source: Float[np.ndarray, " 3"],
    direction: Float[np.ndarray, " 3"],
    positions: Float[np.ndarray, "K 3"],
    transmitter: Float[np.ndarray, " 3"],
    frequency: float,
) -> Complex[np.ndarray, " K"]:
    """Response between two short dipoles in free space, near field included (Balanis, Antenna Theory, chapter 4).

    E = −jωμ₀ Iℓ e^{−jkr}/4πr · [(p − u u·p)(1 + 1/jkr + 1/(jkr)²) − 2 u u·p (1/jkr + 1/(jkr)²)]

    with p the direction of the source's dipole and u that from the source.

    Args:
        source: metres.
        direction: of the source's dipole, unit vector.
        positions: metres.
        transmitter: direction of the dipoles there, unit vector.
        frequency: hertz.
    """
    wavelength = SPEED_OF_LIGHT / frequency
    distance = np.linalg.norm(positions - source, axis=1)
    unit = (positions - source) / distance[:, None]
    along = unit @ direction
    inverse = 1 / (2j * np.pi / wavelength * distance)
    near = inverse + inverse**2
    across = direction @ transmitter - (unit @ transmitter) * along
    field = across * (1 + near) - 2 * (unit @ transmitter) * along * near
    return DIPOLE_GAIN * wavelength / (4 * np.pi * distance) * np.exp(-2j * np.pi * distance / wavelength) * field
