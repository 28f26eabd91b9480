"""Kernels that numba compiles, and threads that run them."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache, partial
from threading import Lock
from typing import Any

import numba

from scenes.files.plain_text import say

ONE_KERNEL = Lock()
"""Held around every call of a kernel compiled with ``parallel=True``. Numba's workqueue threading layer aborts the
process when two Python threads use it at the same time."""

SUMS = {"reassoc", "contract"}
"""``fastmath`` of kernels whose sums may be reordered, but whose numbers that are not finite must stay so."""


def compiled(kernel: Callable | None = None, **options: Any) -> Any:
    """Compile a function by numba when it is first called, as a decorator with or without options.

    The machine code is kept for later processes where numba finds a folder for it: ``NUMBA_CACHE_DIR``, or that of the
    source, or one in the user's home. If none of them can be written to, every process compiles anew.
    """
    if kernel is None:
        return partial(compiled, **options)
    try:
        return numba.njit(cache=True, **options)(kernel)
    except RuntimeError:  # there is no such folder
        _say_that_nothing_is_kept()
        return numba.njit(**options)(kernel)


@cache
def _say_that_nothing_is_kept() -> None:
    say(
        "found no folder to keep compiled functions in, so commands that need them compile them anew, up to a minute; "
        "NUMBA_CACHE_DIR=FOLDER names one"
    )


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
