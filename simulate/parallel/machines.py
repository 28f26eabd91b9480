"""Where a simulation runs: on this machine, or on those of a Ray cluster. All that uses the library Ray is here."""

from __future__ import annotations

import logging
import os
import socket
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

from scenes.files.errors import InputError, ParameterError, reason, require_whole, shown
from scenes.files.optional_packages import require_extra
from scenes.files.options import check_kinds

WORKERS_MOST = 1000  # Largest number of Ray workers, or of solver runs at a time

OWN_PACKAGES = {"worker_process_setup_hook": "bisplat.own_packages.claim"}
"""Workers search the user's folder for modules first, where a file may have the name of one of our packages."""

RETRIES = 20
"""How often a task is given to another worker before the run gives up. The run can be resumed."""


LIMITS = ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes")
"""Files in which Linux states the limit of a container."""


@dataclass(frozen=True)
class Machines:
    """Where a simulation runs. The results are the same everywhere.

    Attributes:
        workers: number of parallel Ray workers (needs bisplat-wrf[ray]), or of parallel runs in full wave. By default
            rays are traced in this process, and full wave has a run per core.
        ray: address of a running Ray cluster that does the work.

    Raises:
        ParameterError: ``workers`` is no whole number from 1 to ``WORKERS_MOST``.
    """

    workers: int | None = None
    ray: str | None = None

    def __post_init__(self) -> None:
        check_kinds(self)
        if self.workers is not None:
            require_whole(1, WORKERS_MOST, workers=self.workers)


def machine_memory() -> float:
    """Bytes of memory of this machine, or of the container if it may take less; infinite if they are not known."""
    known = [float("inf")]
    if hasattr(os, "sysconf"):
        known.append(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    for file in LIMITS:
        with suppress(OSError, ValueError):  # there is no such file, or it says "max"
            known.append(int(Path(file).read_text()))
    return min(known)


def require_ray(address: str | None) -> None:
    """Make sure, before anything is written, that Ray is installed and its cluster answers."""
    require_extra("ray", "simulation by workers or on a cluster")
    if address is None:
        return
    host, _, port = address.removeprefix("ray://").rpartition(":")
    try:  # Ray itself would wait for minutes
        socket.create_connection((host, int(port)), timeout=10).close()
    except (OSError, ValueError, OverflowError) as error:  # OverflowError: a port of too many digits
        message = f"expected the host:port of a running Ray cluster, found {shown(address)} ({reason(error)})"
        raise ParameterError("ray", message) from None


@contextmanager
def ray_cluster(address: str | None) -> Iterator[ModuleType]:
    """Connect to a cluster, or start one on this machine; the context manager gives the module ``ray``."""
    import ray

    os.environ.setdefault("RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO", "0")  # or Ray warns at every start
    # Without an address Ray would join the cluster of another program on this machine.
    options: dict[str, Any] = (
        {"address": "local", "num_cpus": os.cpu_count()} if address is None else {"address": address}
    )
    ray.init(
        log_to_driver=False, include_dashboard=False, logging_level=logging.ERROR, runtime_env=OWN_PACKAGES, **options
    )
    try:
        yield ray
    except ray.exceptions.RayTaskError as error:
        if isinstance(error.cause, InputError):
            raise error.cause from None
        raise
    except ray.exceptions.RayError as error:
        raise InputError(f"Ray lost a task {RETRIES} times: {error}; run it again to go on") from error
    finally:
        ray.shutdown()


def by_workers(machines: Machines, work: Callable, shared: tuple, parts: Iterable[int]) -> Iterator[tuple[int, Any]]:
    """Call ``work(shared, threads, part)`` for each part in some workers, and yield the results as they come."""
    with ray_cluster(machines.ray) as ray:
        workers = machines.workers or len(ray.nodes())
        threads = max(1, int(ray.cluster_resources().get("CPU", 1)) // workers)
        environment = {"OMP_NUM_THREADS": str(threads), "NUMBA_NUM_THREADS": str(threads)}
        task = ray.remote(num_cpus=threads, max_retries=RETRIES)(work).options(runtime_env={"env_vars": environment})
        # One more part than there are workers, so that no worker waits for this process. Not all parts at once, since
        # finished parts take memory.
        yield from _finished(ray, task, (ray.put(shared), threads), parts, workers + 1)


def by_machines(
    address: str, work: Callable, shared: tuple, divided: Callable[[int], list[list[int]]], memory: Callable, gpu: bool
) -> Generator[tuple[list[int], Any]]:
    """Call ``work(shared, part)`` for each part of a work that is divided for some cores, and yield the results.

    Each part takes a core, the bytes ``memory(len(part))``, and perhaps a GPU.
    """
    with ray_cluster(address) as ray:
        machines = [node["Resources"] for node in ray.nodes() if node["Alive"]]
        parts = divided(max(1, int(sum(each.get("CPU", 0) for each in machines))))
        needs = {"CPU": 1, "GPU": int(gpu), "memory": memory(len(parts[0]))}
        if not any(all(each.get(kind, 0) >= amount for kind, amount in needs.items()) for each in machines):
            raise InputError(
                f"{address}: expected a machine with a core, {needs['memory'] / 1e9:.2g} GB of memory"
                f"{' and a GPU' if gpu else ''} in the Ray cluster, found {len(machines)} without"
            )
        task = ray.remote(num_cpus=1, num_gpus=needs["GPU"], memory=needs["memory"], max_retries=RETRIES)(work)
        yield from _finished(ray, task, (ray.put(shared),), parts, len(parts))


def _finished(
    ray: ModuleType, task: Any, given: tuple, parts: Iterable[Any], at_once: int
) -> Iterator[tuple[Any, Any]]:
    """Parts and their results, as they come; a part whose worker is lost is given to another one by Ray."""
    waiting, running = list(parts), dict[Any, Any]()
    while waiting or running:
        while waiting and len(running) < at_once:
            part = waiting.pop(0)
            running[task.remote(*given, part)] = part
        finished, _ = ray.wait(list(running))
        for reference in finished:
            yield running.pop(reference), ray.get(reference)
