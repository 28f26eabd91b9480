"""Make the parts of a dataset by Ray workers, on this machine or a cluster. Only this process writes files.

The results of the engine are sent to the workers. A worker makes its source of responses when its first part arrives,
and keeps it. When a worker is lost, Ray gives its part to another worker.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from simulate.engines.engine import Machines, ResponseSource
from simulate.generation.dataset_part import Part, make_part
from simulate.generation.request import Request
from simulate.parallel.ray_cluster import RETRIES, ray_cluster


def parts_of_workers(
    request: Request, sent: list[Any], starts: list[int], size: int, machines: Machines
) -> Iterator[tuple[int, Part]]:
    """Yield parts in the order in which they are finished, each with the index of its first position."""
    with ray_cluster(machines.ray) as ray:
        cores = int(ray.cluster_resources().get("CPU", 1))
        workers = machines.workers or len(ray.nodes())
        threads = max(1, cores // workers)
        task = ray.remote(num_cpus=threads, max_retries=RETRIES)(_make_part).options(
            runtime_env={"env_vars": {"OMP_NUM_THREADS": str(threads), "NUMBA_NUM_THREADS": str(threads)}}
        )
        shared = ray.put((request, sent, str(request.metadata())))
        waiting = list(starts)
        running: dict[Any, int] = {}
        while waiting or running:
            # One more part than there are workers, so that no worker waits for this process. Not all parts at once,
            # since finished parts take memory.
            while waiting and len(running) <= workers:
                start = waiting.pop(0)
                running[task.remote(shared, threads, start, size)] = start
            finished, _ = ray.wait(list(running))
            for reference in finished:
                yield running.pop(reference), ray.get(reference)


def _make_part(shared: tuple[Request, list[Any], str], threads: int, start: int, size: int) -> Part:
    """Make one part; this function runs in a worker."""
    request, sent, name = shared
    if name not in _sources:
        _sources.clear()
        received = request.engine.received
        sources = [received(setting, each, threads) for setting, each in zip(request.settings, sent, strict=True)]
        _sources[name] = request.of_array(sources)
    return make_part(request, _sources[name], start, size)


_sources: dict[str, list[ResponseSource]] = {}
"""What this worker computes responses with, by the request's metadata."""
