"""Support for parallel work: a lock for kernels in threads, and a Ray cluster."""

from threading import Lock

ONE_KERNEL = Lock()
"""Held around every call of a kernel compiled with ``parallel=True``. Numba's workqueue threading layer aborts the
process when two Python threads use it at the same time."""
