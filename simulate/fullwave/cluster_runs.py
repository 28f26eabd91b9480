"""Solver runs as tasks of a Ray cluster. Its machines need no common file system."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Generator
from pathlib import Path

from scenes.files.errors import InputError
from scenes.scene.description import Scene
from simulate.fullwave.cells import edge_materials
from simulate.fullwave.run_plan import Plan
from simulate.fullwave.solver_runs import groups, run_of
from simulate.fullwave.stored_field import StoredField
from simulate.parallel.ray_cluster import RETRIES, ray_cluster


def elements_of_cluster(
    scene: Scene,
    planned: Plan,
    numbers: list[int],
    solver: str,
    gpu: bool,
    address: str,
    report: Callable[[int, int], None],
) -> Generator[tuple[int, StoredField]]:
    """Run elements on a cluster, and yield the field of each element when its run has ended."""
    with ray_cluster(address) as ray:
        machines = [node["Resources"] for node in ray.nodes() if node["Alive"]]
        cores = int(sum(each.get("CPU", 0) for each in machines))
        parts = groups(numbers, max(1, cores), solver)
        needs = {"CPU": 1, "GPU": int(gpu), "memory": planned.memory(len(parts[0]))}
        if not any(all(each.get(kind, 0) >= amount for kind, amount in needs.items()) for each in machines):
            raise InputError(
                f"{address}: expected a machine with a core, {needs['memory'] / 1e9:.2g} GB of memory"
                f"{' and a GPU' if gpu else ''} in the Ray cluster, found {len(machines)} without"
            )
        task = ray.remote(max_retries=RETRIES)(_run).options(
            num_cpus=needs["CPU"], num_gpus=needs["GPU"], memory=needs["memory"]
        )
        shared = ray.put((scene, planned, solver, gpu))
        running = {task.remote(shared, part): part for part in parts}
        while running:
            finished, _ = ray.wait(list(running))
            for reference in finished:
                part = running.pop(reference)
                try:
                    fields = ray.get(reference)
                except ray.exceptions.RayTaskError as error:
                    if isinstance(error.cause, InputError):
                        raise error.cause from None
                    raise
                for number, field in zip(part, fields, strict=True):
                    report(number, planned.steps)
                    yield number, field


def _run(shared: tuple[Scene, Plan, str, bool], part: list[int]) -> list[StoredField]:
    """Run some elements; this function runs in a worker."""
    scene, planned, solver, gpu = shared
    materials = edge_materials(scene, planned.grid)
    with tempfile.TemporaryDirectory() as working:
        run = run_of(solver, scene, planned, materials, Path(working), gpu)
        return run(part, lambda step: None)
