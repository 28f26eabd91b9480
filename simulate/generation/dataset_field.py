"""The stored field of a dataset folder: made by the solver, or taken from another folder of the same scene."""

from __future__ import annotations

import os
import shutil
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from rich.progress import Progress

from scenes.files.atomic import write_atomically
from scenes.files.errors import InputError, shown
from simulate.dataset.metadata import read_metadata_file
from simulate.fullwave.all_elements import stored_field
from simulate.fullwave.run_plan import Plan, plan
from simulate.fullwave.settings import OURS, FullWave
from simulate.fullwave.settling import SETTLED
from simulate.fullwave.solver_runs import groups
from simulate.fullwave.stored_field import OF_POINTS, StoredField, read_stored_field
from simulate.fullwave.yee_grid import dispersion_residual

if TYPE_CHECKING:
    from simulate.generation.request import Request

FIELD = "field.npz"


def field_of(
    request: Request, folder: Path, workers: int | None, ray: str | None, gpu: bool, progress: Progress
) -> StoredField:
    """The field of a request, from its folder, another folder, or the solver.

    Args:
        request: asks for full wave.
        folder: its dataset folder, which keeps the field.
        workers: number of runs at a time; None: one per core, as far as memory allows.
        ray: address of a running Ray cluster to run the solver on.
        gpu: run gprMax on an NVIDIA GPU.
        progress: shows the runs.

    Raises:
        InputError: the solver failed.
    """
    path = folder / FIELD
    damage = damage_of_field(folder)
    if damage is not None and path.exists():
        progress.console.print(f"{damage}; it is made again", markup=False, highlight=False, soft_wrap=True)
    if damage is not None and request.field is not None:
        write_atomically(path, (request.field / FIELD).read_bytes())
    elif damage is not None:
        _solve(request, folder, workers, ray, gpu, progress).write(path)
    shutil.rmtree(folder / "field", ignore_errors=True)
    field = read_stored_field(path)
    settled, error = 20 * np.log10(max(field.unsettled.max(), 1e-9)), field.interpolation_error_db
    progress.console.print(
        f"stored field: settled to {settled:.0f} dB; error of interpolation at most {error:.0f} dB "
        f"(root mean square of {OF_POINTS:.0%} of the points; it is larger beside objects)"
    )
    if field.unsettled.max() > SETTLED:
        progress.console.print("warning: expected a field that had settled to -60 dB; the place may be a resonator")
    return field


def damage_of_field(folder: Path) -> str | None:
    """Why a dataset folder has no stored field that can be read, as a sentence; None: it has one.

    Args:
        folder: the dataset folder.
    """
    try:
        read_stored_field(folder / FIELD)
    except InputError as error:
        return str(error)
    return None


def _solve(
    request: Request, folder: Path, workers: int | None, ray: str | None, gpu: bool, progress: Progress
) -> StoredField:
    """The field of a request from the solver, which keeps the runs that have ended in the folder ``field``."""
    assert request.fullwave is not None
    planned = plan(request.scene, request.region, request.fullwave.cell)
    count = request.beamformer.array.elements
    at_once = workers or _at_once(planned, count)
    ours_here = request.fullwave.solver == OURS and ray is None
    progress.console.print(description(request, planned, min(at_once, count) if ours_here else None))
    bar = progress.add_task("full wave", total=count)
    done = [0.0] * count

    def report(element: int, step: int) -> None:
        done[element] = step / planned.steps
        progress.update(bar, completed=sum(done))

    solver = request.fullwave.solver
    field = stored_field(request.scene, planned, folder / "field", at_once, solver, gpu, ray, report)
    progress.update(bar, completed=count)
    return field


def _at_once(planned: Plan, count: int) -> int:
    """Number of runs that this machine's cores and memory hold at a time."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    if not hasattr(os, "sysconf"):
        return cores
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    fitting = [number for number in range(1, min(cores, count) + 1) if _memory(planned, count, number) < memory]
    return max(fitting, default=1)


def _memory(planned: Plan, count: int, at_once: int) -> int:
    """Bytes that so many runs at a time take."""
    return at_once * planned.memory(len(groups(list(range(count)), at_once)[0]))


def description(request: Request, planned: Plan, at_once: int | None) -> str:
    """What the runs will be and what coarser cells would, as a sentence for the user.

    Args:
        request: asks for full wave.
        planned: the runs.
        at_once: number of our solver's runs at a time on this machine; None: they run elsewhere, and the sentence says
            nothing of their cost.
    """
    cell, wavelength = planned.grid.cell, request.scene.wavelength
    coarser = 1.25 * cell
    diagonal = float(np.linalg.norm(np.diff(request.scene.extent, axis=0)))
    count = request.beamformer.array.elements

    def errors(cell: float) -> str:
        residual = dispersion_residual(wavelength, cell)
        return (
            f"{100 * residual:.2f} % and phases over {diagonal:.1f} m to {360 * residual * diagonal / wavelength:.0f}°"
        )

    cost = ""
    if at_once is not None:
        minutes, memory = planned.seconds / 60 * count / at_once, _memory(planned, count, at_once)
        cost = (
            f"{memory / 1e9:.2g} GB and at most about {minutes:.2g} minutes on {at_once} core{'s' * (at_once > 1)}; "
            f"{minutes / 1.25**4:.2g} minutes with cells of {1e3 * coarser:.3g} mm; "
        )
    return (
        f"full wave: {planned.grid.cells / 1e6:.1f} million cells of {1e3 * cell:g} mm, at most {planned.steps} time "
        f"steps for each of {count} elements; {cost}wavelengths are right to {errors(cell)}, with cells of "
        f"{1e3 * coarser:.3g} mm to {errors(coarser)}"
    )


def settings_of_field(folder: Path, request: Request) -> FullWave:
    """The settings that a folder's stored field was made with.

    Args:
        folder: another dataset folder.
        request: asks for its field.

    Raises:
        InputError: not the folder of a finished full-wave simulation, or of another scene.
    """
    expected = "a folder that was simulated with --engine fullwave to its end"
    metadata = read_metadata_file(folder / "metadata.json", expected)
    if metadata.get("engine") != "fullwave" or not (folder / FIELD).is_file():
        raise InputError(f"{folder}: expected {expected}, found no {FIELD} of it")
    if metadata["scene_sha256"] != request.metadata()["scene_sha256"]:
        raise InputError(
            f"{folder}: expected the field of the same scene, found that of {shown(metadata.get('scene'))} with other "
            "objects, materials or antennas"
        )
    return FullWave(metadata["fullwave"]["cell"], metadata["fullwave"]["solver"])
