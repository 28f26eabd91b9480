"""The full-wave engine: one run of the solver per element, kept as they end, then the stored field of all."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import replace
from pathlib import Path
from threading import Event

import numpy as np

from scenes.description import Scene
from simulate.array import PlanarArray
from simulate.fullwave.cells import edge_materials
from simulate.fullwave.cluster import elements_of_cluster
from simulate.fullwave.element import element_field
from simulate.fullwave.gprmax import write_geometry
from simulate.fullwave.plan import Plan
from simulate.fullwave.stored_field import StoredField, read_stored_field

WORKING = "running-"
"""Beginning of the names of folders that runs work in."""

Report = Callable[[int, int, int], None]
"""Called with an element's number, and the number of its time steps done and in all."""


def stored_field(
    scene: Scene,
    planned: Plan,
    folder: Path,
    at_once: int = 1,
    gpu: bool = False,
    ray: str | None = None,
    report: Report = lambda element, step, steps: None,
) -> StoredField:
    """The responses of all elements in the region, from one run each; the same call again continues an interrupted one.

    Elements and transmitter are short dipoles, whatever antennas the scene names. The first element's run has as many
    steps as planned, and tells after how many its field had settled; the other runs end there.

    Args:
        scene: the scene.
        planned: the runs.
        folder: keeps ``element-NNN.npz`` of each run that has ended.
        at_once: number of runs at a time, on one core each; when fewer are left, they share the cores.
        gpu: run on an NVIDIA GPU, one run at a time.
        ray: address of a running Ray cluster to run on.
        report: tells the progress.

    Raises:
        InputError: the solver failed.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for left in folder.glob(f"{WORKING}*"):  # by a run that was killed
        shutil.rmtree(left)
    count = PlanarArray.of(scene.gateway).elements
    files = [folder / f"element-{number:03d}.npz" for number in range(count)]

    def keep(fields: Iterator[tuple[int, StoredField]]) -> None:
        for number, field in fields:
            field.write(files[number])

    def run(numbers: list[int], steps: int | None) -> Iterator[tuple[int, StoredField]]:
        if ray is not None:
            return elements_of_cluster(scene, planned, numbers, steps, gpu, ray, report)
        return _elements_here(scene, planned, numbers, steps, folder, 1 if gpu else at_once, gpu, report)

    if not files[0].exists():
        keep(run([0], None))
    keep(run([number for number in range(count) if not files[number].exists()], read_stored_field(files[0]).steps))
    parts = [read_stored_field(file) for file in files]
    field = replace(
        parts[0],
        values=np.concatenate([part.values for part in parts]),
        unsettled=np.concatenate([part.unsettled for part in parts]),
    )
    # Between points twice as far apart the error is far more than between all points.
    return replace(field, interpolation_error_db=field.thinned(2).interpolation_error_db)


def _elements_here(
    scene: Scene,
    planned: Plan,
    numbers: list[int],
    steps: int | None,
    folder: Path,
    at_once: int,
    gpu: bool,
    report: Report,
) -> Iterator[tuple[int, StoredField]]:
    """Run elements on this machine; each one's field when its run has ended."""
    if not numbers:
        return
    threads = max(1, at_once // len(numbers))
    with tempfile.TemporaryDirectory(dir=folder, prefix=WORKING) as geometry:
        write_geometry(Path(geometry), edge_materials(scene, planned.grid), planned.grid)

        stopped = Event()

        def element(number: int) -> tuple[int, StoredField]:
            def told(step: int, steps: int) -> None:
                if stopped.is_set():  # raised here, it ends the solver's process
                    raise InterruptedError
                report(number, step, steps)

            with tempfile.TemporaryDirectory(dir=folder, prefix=WORKING) as working:
                return number, element_field(
                    scene, planned, number, steps, Path(working), Path(geometry), threads, gpu, told
                )

        with ThreadPoolExecutor(at_once) as pool:
            try:
                for done in as_completed([pool.submit(element, number) for number in numbers]):
                    yield done.result()
            except BaseException:
                stopped.set()
                pool.shutdown(cancel_futures=True)
                raise
