"""Simulate a dataset from Python: what ``bisplat simulate`` does, as a function."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
from jaxtyping import Float

from scenes.checks.validation import validate
from scenes.files.errors import InputError, ParameterError, require_seed, require_whole, require_within, shown
from scenes.scene.description import Scene
from scenes.storage.scene_yaml import load_scene
from simulate.dataset.dataset_folder import Dataset, read_dataset
from simulate.fullwave.gprmax import installed_gprmax
from simulate.fullwave.run_plan import default_cell
from simulate.fullwave.settings import OURS, FullWave
from simulate.generation.dataset_field import settings_of_field
from simulate.generation.generate import generate
from simulate.generation.request import Request, read_request
from simulate.positions.given_positions import MOST_POSITIONS
from simulate.positions.placement import check_positions, place, read_positions
from simulate.positions.placement_kind import Placement
from simulate.rays.core.propagation import Propagation
from simulate.spectra.measurement import Measurement

Engine = Literal["rays", "fullwave"]

CELLS = 1e-5, 10.0
"""Metres. A scene says more closely which cells it can be solved with (simulate/fullwave/run_plan.py)."""

WORKERS_MOST = 1000
"""Largest number of Ray workers, or of the solver's runs at a time."""

LEAST_SPECTRA = 2
"""One to train on and one to test on."""


def simulate(
    scene: Scene | str | Path,
    output: str | Path,
    n: int = 6000,
    *,
    placement: Placement = "uniform",
    positions: Float[np.ndarray, "K 3"] | str | Path | None = None,
    seed: int = 0,
    propagation: Propagation = Propagation(),
    measurement: Measurement = Measurement(),
    power_db: bool = False,
    engine: Engine = "rays",
    cell: float | None = None,
    field: str | Path | None = None,
    workers: int | None = None,
    ray: str | None = None,
    gpu: bool = False,
) -> Dataset:
    """Simulate a scene into a NeRF² dataset folder; the same call again finishes an interrupted one.

    Args:
        scene: a scene of one gateway, a built-in place's name, a scene YAML, or a simulated dataset folder, which is
            then made once more by its own settings instead of those given here.
        output: the dataset folder.
        n: number of transmitter positions to draw.
        placement: how they are drawn in the scene's region.
        positions: positions to use instead, metres, world frame, or a CSV of them with the header x,y,z.
        seed: seed of the positions, the rays, the train/test split and the receiver's errors.
        propagation: the mechanisms to follow.
        measurement: errors that the receiver adds.
        power_db: also write each spectrum's absolute power in dB.
        engine: "rays": trace rays; "fullwave": solve Maxwell's equations by finite differences.
        cell: side of the cells in full wave, metres; None: a seventh of the shortest wavelength in a
            material, at most a sixteenth of that in air.
        field: folder of a full-wave dataset of the same scene, whose stored field is used instead of a new run.
        workers: trace with so many Ray workers at a time; in this process if neither this nor ``ray`` is given. In full
            wave, the number of the solver's runs at a time; None: one per core.
        ray: address of a running Ray cluster to trace on.
        gpu: in full wave, run gprMax on an NVIDIA GPU (needs bisplat-wrf[fullwave] and pycuda).

    Returns:
        The dataset, read from the folder.

    Raises:
        InputError: a scene that is refused or has several gateways, or a folder that holds something else.
        ParameterError: a parameter out of its range, or positions inside an object.

    >>> import bisplat, tempfile
    >>> floor = bisplat.SceneObject("floor", bisplat.shapes.sheet((-5, -5, 0), (10, 0, 0), (0, 10, 0)), "concrete")
    >>> gateway = bisplat.Gateway(position=(0, 0, 1.5), orientation=bisplat.facing((-1, 0, 0)))
    >>> region = bisplat.Transmitter(region_min=(-4, -1, 0.5), region_max=(-2, 1, 2))
    >>> materials = bisplat.p2040_materials(["concrete"], 915e6)
    >>> yard = bisplat.Scene("yard", 915e6, gateway, region, (floor,), materials)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     dataset = simulate(yard, f"{folder}/yard", n=3, propagation=Propagation(max_depth=1, rays=10_000))
    >>> dataset.positions.shape, dataset.responses.shape, dataset.pictures.shape
    ((3, 3), (3, 16), (3, 90, 360))
    """
    check_numbers(n, seed, cell, workers)
    request = request_for(scene, n, placement, positions, seed, propagation, measurement, seed, power_db)
    request = with_engine(request, engine, cell, None if field is None else Path(field), gpu)
    generate(request, Path(output), workers, ray, gpu)
    return read_dataset(output)


def check_numbers(n: int, seed: int, cell: float | None, workers: int | None) -> None:
    """Refuse numbers that ``simulate`` cannot work with, before it reads or writes anything.

    Args:
        n: as of ``simulate``, and so the others.

    Raises:
        ParameterError: no whole number of spectra from ``LEAST_SPECTRA`` to ``MOST_POSITIONS``, a seed that is none,
            cells outside ``CELLS``, or no workers or more than ``WORKERS_MOST``.
    """
    require_whole(LEAST_SPECTRA, MOST_POSITIONS, n=n)
    require_seed(seed=seed)
    if cell is not None:
        require_within(*CELLS, "metres", cell=cell)
    if workers is not None:
        require_whole(1, WORKERS_MOST, workers=workers)


def with_engine(request: Request, engine: Engine, cell: float | None, field: Path | None, gpu: bool) -> Request:
    """A request by another engine.

    Args:
        request: a request that traces rays, or one that was read from a folder and has its engine.
        engine: as of ``simulate``.
        cell: as of ``simulate``.
        field: as of ``simulate``.
        gpu: as of ``simulate``.

    Raises:
        ParameterError: cells or a field for rays, or cells of no size.
        InputError: a field's folder that is none, or gprMax is needed and not installed.
    """
    if engine == "rays" and request.fullwave is None:
        for name, value in (("cell", cell), ("field", field)):
            if value is not None:
                raise ParameterError(name, f"expected none, or the engine fullwave, found {shown(value)} for rays")
        return request
    if field is not None:
        return replace(request, fullwave=settings_of_field(field, request), field=field)
    given = request.fullwave or FullWave(default_cell(request.scene) if cell is None else cell, OURS)
    solver = installed_gprmax() if gpu or given.solver != OURS else OURS
    return replace(request, fullwave=FullWave(given.cell, solver))


def request_for(
    scene: Scene | str | Path,
    n: int,
    placement: Placement,
    positions: Float[np.ndarray, "K 3"] | str | Path | None,
    seed: int,
    propagation: Propagation,
    measurement: Measurement,
    measurement_seed: int,
    power_db: bool,
) -> Request:
    """Everything that the content of a dataset folder depends on.

    Args:
        scene: as of ``simulate``.
        n: as of ``simulate``.
        placement: as of ``simulate``.
        positions: as of ``simulate``.
        seed: seed of the positions, the rays and the train/test split.
        propagation: as of ``simulate``.
        measurement: as of ``simulate``.
        measurement_seed: seed of the receiver's errors.
        power_db: as of ``simulate``.

    Returns:
        The request, for ``simulate.generation.generate``.

    Raises:
        InputError: as ``simulate``.
        ParameterError: as ``simulate``.
    """
    if not isinstance(scene, Scene) and Path(scene).is_dir():
        return read_request(Path(scene))
    if isinstance(scene, Scene):
        validate(scene, scene.name)
    else:
        scene = load_scene(scene)
    if scene.further_gateways:
        raise InputError(
            f"{scene.name}: expected a scene of one gateway, found {len(scene.by_gateway())}; simulate each scene of "
            "scene.by_gateway() into a folder of its own"
        )
    if positions is None:
        points, how = place(scene, placement, n, seed), f"{placement}, seed {seed}"
    elif isinstance(positions, np.ndarray):
        points, how = check_positions(positions, scene), "given positions"
    else:
        points, how = read_positions(Path(positions), scene), f"positions of {Path(positions).name}"
    return Request(scene, points, how, propagation, seed, measurement, measurement_seed, power_db)
