"""Parts of a dataset made by Ray workers, on this machine or a cluster; this process alone writes files.

The chains are found once, by the caller, and sent to the workers. A worker builds the scene when its first part
arrives and keeps it. When a worker is lost, Ray gives its part to another worker.
"""

from __future__ import annotations

import logging
import os
import socket
from collections.abc import Iterator
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from scenes.errors import InputError, ParameterError
from simulate.dataset_part import Part, make_part
from simulate.request import Request

if TYPE_CHECKING:  # need the ray tracer
    from simulate.chains import Chains
    from simulate.trace import Tracer

RETRIES = 20
"""How often a part is given to another worker before the run gives up (and can be resumed)."""


def require_ray(address: str | None) -> None:
    """Make sure, before anything is written, that Ray is installed and its cluster answers.

    Args:
        address: of a running Ray cluster; None if Ray is to be started on this machine.

    Raises:
        InputError: Ray is not installed.
        ParameterError: nothing listens at the address (host:port or ray://host:port).
    """
    if find_spec("ray") is None:
        raise InputError("tracing with workers needs Ray: in the checkout, pip install -c constraints.txt '.[ray]'")
    if address is None:
        return
    host, _, port = address.removeprefix("ray://").rpartition(":")
    try:  # Ray itself would wait for minutes
        socket.create_connection((host, int(port)), timeout=10).close()
    except (OSError, ValueError) as error:
        message = f"expected the host:port of a running Ray cluster, found {address} ({error})"
        raise ParameterError("ray", message) from None


def parts_of_workers(
    request: Request, chains: Chains | None, starts: list[int], size: int, workers: int | None, address: str | None
) -> Iterator[tuple[int, Part]]:
    """Parts in the order they are finished, with their first position's index.

    Args:
        request: the dataset to make.
        chains: ``Tracer.chains`` of a tracer of the request.
        starts: first positions of the parts to make.
        size: positions per part.
        workers: parts made at a time; one per machine of the cluster if None.
        address: of a running Ray cluster; a Ray of its own on this machine if None.

    Raises:
        InputError: a part was lost ``RETRIES`` times.
    """
    import ray

    os.environ.setdefault("RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO", "0")  # or Ray warns at every start
    options: dict[str, Any] = {"num_cpus": os.cpu_count()} if address is None else {"address": address}
    ray.init(log_to_driver=False, include_dashboard=False, logging_level=logging.ERROR, **options)
    try:
        cores = int(ray.cluster_resources().get("CPU", 1))
        workers = workers or len(ray.nodes())
        threads = max(1, cores // workers)
        task = ray.remote(num_cpus=threads, max_retries=RETRIES)(_trace_part).options(
            runtime_env={"env_vars": {"OMP_NUM_THREADS": str(threads), "NUMBA_NUM_THREADS": str(threads)}}
        )
        shared = ray.put((request, chains, str(request.metadata())))
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
    except ray.exceptions.RayError as error:
        if isinstance(error, ray.exceptions.RayTaskError):
            raise
        raise InputError(f"Ray lost a part of the dataset {RETRIES} times: {error}; run it again to go on") from error
    finally:
        ray.shutdown()


def _trace_part(shared: tuple[Request, Chains | None, str], threads: int, start: int, size: int) -> Part:
    """Make one part; this function runs in a worker."""
    request, chains, name = shared
    if name not in _tracers:
        from simulate.ray_tracer import dr
        from simulate.trace import Tracer

        dr.set_thread_count(threads)
        _tracers.clear()
        _tracers[name] = Tracer(request.scene, request.propagation, request.region, request.seed, found=chains)
    return make_part(request, _tracers[name], start, size)


_tracers: dict[str, Tracer] = {}
"""The scene this worker has built, by the request's metadata."""
