"""Runs of the solver as tasks of a Ray cluster, whose machines need gprMax but no common file system."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

from scenes.description import Scene
from scenes.errors import InputError
from simulate.fullwave.cells import edge_materials
from simulate.fullwave.element import element_field
from simulate.fullwave.gprmax import write_geometry
from simulate.fullwave.plan import Plan
from simulate.fullwave.stored_field import StoredField
from simulate.ray_cluster import RETRIES, ray_cluster


def elements_of_cluster(
    scene: Scene,
    planned: Plan,
    numbers: list[int],
    steps: int | None,
    gpu: bool,
    address: str,
    report: Callable[[int, int, int], None],
) -> Iterator[tuple[int, StoredField]]:
    """Fields of elements, in the order in which their runs end.

    Args:
        scene: the scene.
        planned: the runs.
        numbers: of the elements.
        steps: as of ``element_field``.
        gpu: run on NVIDIA GPUs, one run on each at a time; otherwise one on each core.
        address: of a running Ray cluster.
        report: called with an element's number and twice its time steps, when its run has ended.

    Raises:
        InputError: the solver failed, a run was lost ``RETRIES`` times, or no machine is large enough for one.
    """
    if not numbers:
        return
    needs = {"CPU": 1, "GPU": int(gpu), "memory": planned.memory}
    with ray_cluster(address) as ray:
        machines = [node["Resources"] for node in ray.nodes() if node["Alive"]]
        if not any(all(each.get(kind, 0) >= amount for kind, amount in needs.items()) for each in machines):
            raise InputError(
                f"{address}: expected a machine with a core, {planned.memory / 1e9:.2g} GB of memory"
                f"{' and a GPU' if gpu else ''} in the Ray cluster, found {len(machines)} without"
            )
        task = ray.remote(max_retries=RETRIES)(_run).options(
            num_cpus=needs["CPU"], num_gpus=needs["GPU"], memory=needs["memory"]
        )
        shared = ray.put((scene, planned, steps, gpu))
        running = {task.remote(shared, number): number for number in numbers}
        while running:
            finished, _ = ray.wait(list(running))
            for reference in finished:
                number = running.pop(reference)
                try:
                    field = ray.get(reference)
                except ray.exceptions.RayTaskError as error:
                    if isinstance(error.cause, InputError):
                        raise error.cause from None
                    raise
                report(number, field.steps, field.steps)
                yield number, field


def _run(shared: tuple[Scene, Plan, int | None, bool], number: int) -> StoredField:
    """Run one element; this function runs in a worker."""
    scene, planned, steps, gpu = shared
    with tempfile.TemporaryDirectory() as geometry, tempfile.TemporaryDirectory() as working:
        write_geometry(Path(geometry), edge_materials(scene, planned.grid), planned.grid)
        return element_field(scene, planned, number, steps, Path(working), Path(geometry), gpu=gpu)
