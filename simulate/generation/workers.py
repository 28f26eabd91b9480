"""Parts of a dataset made by Ray workers, on this machine or a cluster; this process alone writes files.

The chains are found once, by the caller, and sent to the workers. A worker builds the scene when its first part
arrives and keeps it. When a worker is lost, Ray gives its part to another worker.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from simulate.generation.dataset_part import Part, make_part
from simulate.generation.request import Request
from simulate.parallel.ray_cluster import RETRIES, ray_cluster

if TYPE_CHECKING:  # need the ray tracer
    from simulate.rays.tracer import Found, Tracer


def parts_of_workers(
    request: Request, found: Found, starts: list[int], size: int, workers: int | None, address: str | None
) -> Iterator[tuple[int, Part]]:
    """Parts in the order they are finished, with their first position's index.

    Args:
        request: the dataset to make.
        found: ``Tracer.found`` of a tracer of the request.
        starts: first positions of the parts to make.
        size: positions per part.
        workers: parts made at a time; one per machine of the cluster if None.
        address: of a running Ray cluster; a Ray of its own on this machine if None.

    Raises:
        InputError: a part was lost ``RETRIES`` times.
    """
    with ray_cluster(address) as ray:
        cores = int(ray.cluster_resources().get("CPU", 1))
        workers = workers or len(ray.nodes())
        threads = max(1, cores // workers)
        task = ray.remote(num_cpus=threads, max_retries=RETRIES)(_trace_part).options(
            runtime_env={"env_vars": {"OMP_NUM_THREADS": str(threads), "NUMBA_NUM_THREADS": str(threads)}}
        )
        shared = ray.put((request, found, str(request.metadata())))
        waiting = list(starts)
        running: dict[Any, int] = {}
        while waiting or running:
            # One part more than there are workers, so that no worker waits for this process. Not all parts at once,
            # since finished parts take memory.
            while waiting and len(running) <= workers:
                start = waiting.pop(0)
                running[task.remote(shared, threads, start, size)] = start
            finished, _ = ray.wait(list(running))
            for reference in finished:
                yield running.pop(reference), ray.get(reference)


def _trace_part(shared: tuple[Request, Found, str], threads: int, start: int, size: int) -> Part:
    """Make one part; this function runs in a worker."""
    request, found, name = shared
    if name not in _tracers:
        from simulate.rays.core.ray_tracer import dr
        from simulate.rays.tracer import Tracer

        dr.set_thread_count(threads)
        _tracers.clear()
        _tracers[name] = Tracer(request.scene, request.propagation, request.region, request.seed, found=found)
    return make_part(request, _tracers[name], start, size)


_tracers: dict[str, Tracer] = {}
"""The scene this worker has built, by the request's metadata."""
