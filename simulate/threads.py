"""One parallel kernel at a time: numba's plainest pool of threads ends the process when two Python threads enter it."""

from threading import Lock

ONE_KERNEL = Lock()
"""Held around every call of a kernel compiled with ``parallel=True``."""
