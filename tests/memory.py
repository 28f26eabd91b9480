"""Memory is given back after each file of tests; a session's last lines tell how much each of its processes needed."""

import ctypes
import gc
import resource
import sys
from collections.abc import Iterator

import pytest

PEAKS = pytest.StashKey[dict[str, int]]()
"""Bytes by the name of a process."""


@pytest.fixture(scope="module", autouse=True)
def give_memory_back() -> Iterator[None]:
    """What Dr.Jit and the C library keep of freed memory for later goes back to the system."""
    yield
    gc.collect()
    if "drjit" in sys.modules:
        sys.modules["drjit"].flush_malloc_cache()
    if trim := getattr(ctypes.CDLL(None), "malloc_trim", None):  # glibc has it
        trim(0)


def _peak() -> int:
    """Bytes of memory that this process had at most."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def pytest_sessionfinish(session: pytest.Session) -> None:
    """A worker of pytest-xdist tells its peak."""
    if hasattr(session.config, "workeroutput"):
        session.config.workeroutput["peak"] = _peak()


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node) -> None:
    """The session that started the worker takes note of it; one that crashed told nothing."""
    if hasattr(node, "workeroutput"):
        node.config.stash.setdefault(PEAKS, {})[node.gateway.id] = node.workeroutput["peak"]


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Print the line."""
    peaks = terminalreporter.config.stash.get(PEAKS, {"pytest": _peak()})
    told = ", ".join(f"{name} {peak / 1e9:.1f} GB" for name, peak in sorted(peaks.items()))
    terminalreporter.write_line(f"most memory: {told}")
