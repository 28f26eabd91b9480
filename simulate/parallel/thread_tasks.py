"""A long loop divided among threads, for kernels that release Python's lock."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numba


def in_threads(work: Callable[[slice], None], count: int, task: int) -> None:
    """Call ``work`` with slices of at most ``task`` of ``count`` items, on as many threads as numba has."""
    parts = [slice(first, min(first + task, count)) for first in range(0, count, task)]
    threads = min(numba.get_num_threads(), len(parts))
    if threads < 2:
        for part in parts:
            work(part)
        return
    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(work, parts))
