"""One run of gprMax: the field that one source produces in a box, from the materials of the cells.

gprMax [warren2016] runs on NVIDIA GPUs, and our own solver is tested against it. It is an optional extra,
bisplat-wrf[fullwave]. Since its licence is the GPL, it runs as a separate program that reads and writes files.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from collections.abc import Callable, Sequence
from importlib.metadata import version
from pathlib import Path

import numpy as np
from jaxtyping import Complex, Int

from scenes.files.errors import InputError
from scenes.files.optional_packages import require_extra
from simulate.fullwave.cells import AIR, CONDUCTOR, PERMEABILITY, EdgeMaterials, beside_edges
from simulate.fullwave.dipole import Source
from simulate.fullwave.leapfrog import ABSORBER
from simulate.fullwave.yee_grid import YeeGrid

GEOMETRY, MODEL = "geometry", "model"

RISE = 6
"""Periods over which the amplitude of the source rises, as half a raised cosine. The rise is slow, so that the source
hardly radiates at other frequencies."""

SNAPSHOTS = 4
"""Number of moments in a period at which the field is kept. Amplitude, phase and a constant are fitted to them. The
constant is needed, since the start of the oscillation leaves static charges at the ends of the dipole."""

PROGRESS = re.compile(r"\|--->:.*?(\d+)/\d+ \[")


def installed_gprmax(what: str) -> str:
    require_extra("fullwave", what)
    return f"gprMax {version('gprMax')}"


def write_geometry(folder: Path, materials: EdgeMaterials, grid: YeeGrid) -> None:
    """Write the materials of all edges for gprMax, as geometry.h5 and geometry_materials.json."""
    import h5py

    used, index = np.unique(materials.index, return_inverse=True)
    numbers = np.union1d(used, [CONDUCTOR, AIR])
    index = np.searchsorted(numbers, used)[index].reshape(materials.index.shape)
    air = int(np.searchsorted(numbers, AIR))
    conductivity = ["inf" if each == CONDUCTOR else float(materials.conductivity[each]) for each in numbers]
    electric = [
        _material({CONDUCTOR: "pec", AIR: "free_space"}.get(each, f"slab_{each}"), permittivity, sigma, 1.0)
        for each, permittivity, sigma in zip(
            numbers.tolist(), materials.permittivity[numbers].tolist(), conductivity, strict=True
        )
    ]
    magnetic = [_material(f"beside_edge_{n}", 1.0, 0.0, each) for n, each in enumerate(PERMEABILITY[1:], start=1)]
    described = {f"material_{number:05d}": each for number, each in enumerate([*electric, *magnetic])}
    of_magnetic = np.array([air, *range(len(electric), len(described))], np.uint32)
    database = f"{GEOMETRY}_materials"
    (folder / f"{database}.json").write_text(
        json.dumps(
            {
                "schema": "gprMax-material-database",
                "schema_version": 1,
                "database": {"id": database, "name": database, "version": "1.0.0", "description": "made by bisplat"},
                "materials": described,
            }
        )
    )
    with h5py.File(folder / f"{GEOMETRY}.h5", "w") as file:
        file.attrs["MaterialDatabase"] = database
        file.attrs["MaterialDatabaseSchemaVersion"] = 1
        file.attrs["Title"] = GEOMETRY
        file.attrs["dx_dy_dz"] = np.full(3, grid.cell)
        file.attrs["gprMax"] = "4.0.1"
        file["material_keys"] = np.array(list(described), "S")
        file["data"] = np.full(grid.shape, air, np.int16)
        components = file.create_dataset("ID", (6, *index.shape[1:]), np.uint32)
        components[:3], components[3:] = index, of_magnetic[beside_edges(materials.index == CONDUCTOR)]
        # With 1, gprMax does not derive the materials of the edges from those of the cells.
        file["rigidE"] = np.ones((12, *grid.shape), np.int8)
        file["rigidH"] = np.ones((6, *grid.shape), np.int8)


def _material(name: str, permittivity: float, conductivity: float | str, permeability: float) -> dict[str, object]:
    return {
        "name": name,
        "model": "constant",
        "base": {
            "relative_permittivity": permittivity,
            "electric_conductivity_s_per_m": conductivity,
            "relative_permeability": permeability,
            "magnetic_conductivity_s_per_m": 0.0,
        },
        "averagable": False,
        "metadata": {"original_id": name},
    }


def run(
    folder: Path,
    geometry: Path,
    grid: YeeGrid,
    source: Source,
    box: Int[np.ndarray, "2 3"],
    ends: Sequence[int],
    gpu: bool = False,
    report: Callable[[int], None] = lambda done: None,
) -> Complex[np.ndarray, "ends 3 nx ny nz"]:
    iterations = _write_input(folder, geometry, grid, source, box, ends)
    command = [sys.executable, "-m", "gprMax", f"{MODEL}.in", "--show-progress-bars", *(["-gpu"] if gpu else [])]
    environment = os.environ | {"OMP_NUM_THREADS": "1"}
    with subprocess.Popen(
        command, cwd=folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, bufsize=1
    ) as process:
        assert process.stdout is not None
        lines: list[str] = []
        try:
            for line in process.stdout:  # lines may end with a carriage return
                lines = [*lines[-20:], line.rstrip()]
                found = PROGRESS.search(line)
                if found is not None:
                    report(int(found[1]))
        except BaseException:
            process.kill()
            raise
    if process.returncode != 0:
        said = " / ".join(line for line in lines if line.strip())[-600:]
        raise InputError(f"{folder / MODEL}.in: expected gprMax to run to its end, found that it stopped with: {said}")
    return _phasors(folder, grid, source, iterations)


def _write_input(
    folder: Path, geometry: Path, grid: YeeGrid, source: Source, box: Int[np.ndarray, "2 3"], ends: Sequence[int]
) -> list[list[int]]:
    """Write model.in and excitation.txt, and return the time steps of the snapshots before each end."""
    cell, step = grid.cell, grid.time_step
    size = [count * cell for count in grid.shape]
    # Moments a quarter of a period apart before each end. gprMax numbers its time steps from 0.
    quarter = round(1 / (SNAPSHOTS * source.frequency * step))
    iterations = [[end - 1 - number * quarter for number in range(SNAPSHOTS)] for end in ends]
    dipoles = [
        ("xyz"[axis], point, share)
        for axis, points, shares in source.edges(grid)
        for point, share in zip(points, shares, strict=True)
    ]
    amplitudes, which = np.unique(np.round([weight for *_, weight in dipoles], 9), return_inverse=True)
    # gprMax interpolates the current linearly at half steps, so the times in the file are half steps.
    times = step * (np.arange(ends[-1] + 3) - 0.5)
    rise = 0.5 - 0.5 * np.cos(np.pi * np.clip(times * source.frequency / RISE, 0, 1))
    wave = rise * np.cos(2 * np.pi * source.frequency * times)
    names = " ".join(f"wave{number}" for number in range(len(amplitudes)))
    np.savetxt(
        folder / "excitation.txt",
        np.column_stack([times, wave[:, None] * amplitudes]),
        fmt="%.8e",
        header=f"time {names}",
        comments="",
    )
    spans = " ".join(f"{value:.9g}" for value in (box * cell).ravel())
    lines = [
        f"#title: {MODEL}",
        f"#domain: {size[0]:.9g} {size[1]:.9g} {size[2]:.9g}",
        f"#dx_dy_dz: {cell!r} {cell!r} {cell!r}",
        f"#time_window: {ends[-1]}",
        f"#pml_cells: {ABSORBER}",
        "#excitation_file: excitation.txt",
        f"#geometry_objects_read: 0 0 0 {(geometry / GEOMETRY).resolve()}.h5 {GEOMETRY}_materials",
    ]
    for (letter, point, _), number in zip(dipoles, which, strict=True):
        x, y, z = point * cell
        lines.append(f"#hertzian_dipole: {letter} {x:.9g} {y:.9g} {z:.9g} wave{number}")
    lines += [
        f"#snapshot: {spans} {cell!r} {cell!r} {cell!r} {iteration} {iteration}.h5"
        for iteration in sorted({each for group in iterations for each in group})
    ]
    (folder / f"{MODEL}.in").write_text("\n".join(lines) + "\n")
    return iterations


def _phasors(
    folder: Path, grid: YeeGrid, source: Source, iterations: list[list[int]]
) -> Complex[np.ndarray, "ends 3 nx ny nz"]:
    """The phasor E of the field Re(E e^{jωt}) + const after each end, by least squares from its snapshots."""
    import h5py

    found = []
    for group in iterations:
        fields = []
        for iteration in group:
            with h5py.File(folder / f"{MODEL}_snaps" / f"{iteration}.h5") as file:
                fields.append(np.stack([file[f"E{axis}"][:] for axis in "xyz"]))
        phase = 2 * np.pi * source.frequency * grid.time_step * np.array(group)
        design = np.stack([np.cos(phase), -np.sin(phase), np.ones_like(phase)], axis=1)
        real, imaginary, _ = np.tensordot(np.linalg.pinv(design), np.stack(fields), axes=1)
        found.append((real + 1j * imaginary) / grid.cell)  # in gprMax a dipole is as long as a cell
    return np.stack(found)
