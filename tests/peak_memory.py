"""A line at the end of every session of pytest: the memory that it, or each of its workers, needed at most."""

import resource

import pytest

PEAKS = pytest.StashKey[dict[str, int]]()
"""Bytes by the name of a process."""


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
