"""Memory is given back after each file of tests; a session's last lines tell how much each of its processes needed."""

import ctypes
import gc
import resource
import sys

import psutil
import pytest

MUCH = 200_000_000  # Bytes

LEFT = pytest.StashKey[int]()  # Bytes of memory after it was last given back

PEAKS = pytest.StashKey[dict[str, int]]()  # Bytes by the name of a process


def _resident() -> int:
    """Bytes of memory that this process has now."""
    return psutil.Process().memory_info().rss


@pytest.hookimpl(trylast=True)  # when the fixtures are gone
def pytest_runtest_teardown(item: pytest.Item, nextitem: pytest.Item | None) -> None:
    """After each file, and after each test that left much, what was freed goes back to the system.

    Figures of matplotlib wait for Python's garbage collection, and Dr.Jit and the C library keep memory for later.
    """
    last_of_file = nextitem is None or nextitem.path != item.path
    if not last_of_file and _resident() < item.config.stash.get(LEFT, 0) + MUCH:
        return
    gc.collect()
    if "drjit" in sys.modules:
        sys.modules["drjit"].flush_malloc_cache()
    if sys.platform == "linux":
        ctypes.CDLL(None).malloc_trim(0)
    item.config.stash[LEFT] = _resident()


def _peak() -> int:
    """Bytes of memory that this process had at most."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)


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
