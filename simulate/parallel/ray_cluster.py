"""A connection to a Ray cluster, or to a Ray started on this machine."""

from __future__ import annotations

import logging
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from types import ModuleType
from typing import Any

from scenes.files.errors import InputError, ParameterError, reason, shown
from scenes.files.optional_packages import require_extra

OWN_PACKAGES = {"worker_process_setup_hook": "bisplat.own_packages.claim"}
"""Workers search the user's folder for modules first, where a file may have the name of one of our packages."""

RETRIES = 20
"""How often a task is given to another worker before the run gives up. The run can be resumed."""


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
    """Connect to a cluster. The context manager gives the module ``ray``."""
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
    except ray.exceptions.RayError as error:
        if isinstance(error, ray.exceptions.RayTaskError):
            raise
        raise InputError(f"Ray lost a task {RETRIES} times: {error}; run it again to go on") from error
    finally:
        ray.shutdown()
