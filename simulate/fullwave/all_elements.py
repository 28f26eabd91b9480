"""The full-wave engine: solver runs for some elements each, stored as they end, then the stored field of all."""

from __future__ import annotations

import shutil
import sys
import tempfile
from collections.abc import Callable, Generator
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import closing
from dataclasses import replace
from functools import partial
from pathlib import Path
from threading import Event

import numpy as np

from scenes.files.errors import InputError
from simulate.fullwave import OURS
from simulate.fullwave.element_fields import groups, run_of
from simulate.fullwave.run_plan import Plan
from simulate.fullwave.stored_field import StoredField, read_stored_field, together
from simulate.parallel.machines import by_machines

WORKING = "running-"  # Prefix of the names of the folders in which runs work

Report = Callable[[int, int], None]
"""Called with the number of an element, and the number of its finished time steps."""


def stored_field(
    planned: Plan,
    folder: Path,
    at_once: int = 1,
    solver: str = OURS,
    gpu: bool = False,
    ray: str | None = None,
    report: Report = lambda element, step: None,
) -> StoredField:
    """The responses of all elements, short dipoles, in the region; the same call continues an interrupted one."""
    folder.mkdir(parents=True, exist_ok=True)
    for left in folder.glob(f"{WORKING}*"):  # left by a run that was killed
        shutil.rmtree(left)
    count = planned.scene.gateway.count
    files = [folder / f"element-{number:03d}.npz" for number in range(count)]
    missing = [number for number in range(count) if not _is_whole(files[number], planned)]
    if missing:
        if ray is not None:
            ended = _elements_of_cluster(planned, missing, solver, gpu, ray, report)
        else:
            ended = _elements_here(planned, missing, folder, 1 if gpu else at_once, solver, gpu, report)
        with closing(ended):  # an error here ends the runs
            for number, each in ended:
                each.write(files[number])
    parts = [read_stored_field(file) for file in files]
    field = replace(
        parts[0],
        values=np.concatenate([part.values for part in parts]),
        unsettled=np.concatenate([part.unsettled for part in parts]),
        steps=max(part.steps for part in parts),
        band=together([part.band for part in parts]),
    )
    # The error with every second point is an upper bound: it is much larger than with all points.
    return replace(field, interpolation_error_db=field.thinned(2).interpolation_error_db)


def _is_whole(file: Path, planned: Plan) -> bool:
    """Whether an element's run has ended and its file can be read. A damaged file is reported on stderr."""
    try:
        found = read_stored_field(file)
        if planned.band is not None and found.band is None:
            raise InputError(f"{file}: expected the field over a band, found that of the carrier alone")
    except InputError as error:
        if file.exists():
            print(f"bisplat: {error}; it is made again", file=sys.stderr)
        return False
    return True


def _elements_here(
    planned: Plan, numbers: list[int], folder: Path, at_once: int, solver: str, gpu: bool, report: Report
) -> Generator[tuple[int, StoredField]]:
    """Run elements on this machine, and yield the field of each element when its run has ended."""
    with tempfile.TemporaryDirectory(dir=folder, prefix=WORKING) as working:
        run = run_of(solver, planned, Path(working), gpu)
        stopped = Event()

        def part(elements: list[int]) -> list[tuple[int, StoredField]]:
            def told(step: int) -> None:
                if stopped.is_set():
                    raise InterruptedError
                for element in elements:
                    report(element, step)

            return list(zip(elements, run(elements, told), strict=True))

        with ThreadPoolExecutor(at_once) as pool:
            try:
                submitted = [pool.submit(part, elements) for elements in groups(numbers, at_once, solver)]
                for done in as_completed(submitted):
                    yield from done.result()
            except BaseException:
                stopped.set()
                pool.shutdown(cancel_futures=True)
                raise


def _elements_of_cluster(
    planned: Plan, numbers: list[int], solver: str, gpu: bool, address: str, report: Report
) -> Generator[tuple[int, StoredField]]:
    """Run elements on a cluster, whose machines need no common file system, and yield the field of each."""
    divided, shared = partial(groups, numbers, solver=solver), (planned, solver, gpu)
    with closing(by_machines(address, _run_there, shared, divided, planned.memory, gpu)) as ended:
        for part, fields in ended:
            for number, field in zip(part, fields, strict=True):
                report(number, planned.steps)
                yield number, field


def _run_there(shared: tuple[Plan, str, bool], part: list[int]) -> list[StoredField]:
    """Run some elements; this function runs in a worker."""
    planned, solver, gpu = shared
    with tempfile.TemporaryDirectory() as working:
        return run_of(solver, planned, Path(working), gpu)(part, lambda step: None)
