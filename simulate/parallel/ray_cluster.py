"""A connection to a Ray cluster, or to a Ray started on this machine."""

from __future__ import annotations

import logging
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from types import ModuleType
from typing import Any

from scenes.files.errors import InputError, ParameterError, reason, shown

OWN_PACKAGES = {"worker_process_setup_hook": "bisplat.own_packages.claim"}
"""Workers search the user's folder for modules first, where a file may have the name of one of our packages."""

RETRIES = 20
"""How often a task is given to another worker before the run gives up. The run can be resumed."""


def require_ray(address: str | None) -> None:
    """Make sure, before anything is written, that Ray is installed and its cluster answers.

    Args:
        address: address of a running Ray cluster; None to start Ray on this machine.

    Raises:
        InputError: Ray is not installed.
        ParameterError: nothing listens at the address (host:port or ray://host:port).
    """
    if find_spec("ray") is None:
        raise InputError("workers and clusters need Ray: in the checkout, pip install -c constraints.txt '.[ray]'")
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
    """Connect to a cluster. The context manager gives the module ``ray``.

    Args:
        address: address of a running Ray cluster; None to start Ray on this machine.

    Raises:
        InputError: a task was lost ``RETRIES`` times.
    """
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
