"""A lock for parallel kernels: numba's workqueue threading layer aborts the process when two Python threads use it."""

from threading import Lock

ONE_KERNEL = Lock()
"""Held around every call of a kernel compiled with ``parallel=True``."""
