"""Run a program, kill it with SIGKILL at given moments, and at last let it finish."""

import os
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

READY = "ready"
"""A line that the program prints on stdout when it has imported what it needs; the moments count from there."""


def kills() -> int:
    """How often a test kills; the variable BISPLAT_KILLS sets another number than the suite's."""
    return int(os.environ.get("BISPLAT_KILLS", "2"))


def moments(seed: int, longest: float) -> list[float]:
    """Random seconds for as many kills as ``kills`` says."""
    return (longest * np.random.default_rng(seed).uniform(0.05, 0.9, kills())).tolist()


def finish(code: str, *arguments: str | Path) -> float:
    """Run a Python program to its end, which has to be a success."""
    process = _start(code, arguments)
    began = time.perf_counter()
    _, errors = process.communicate()
    assert process.returncode == 0, errors
    return time.perf_counter() - began


def kill_and_finish(code: str, *arguments: str | Path, after: Sequence[float]) -> int:
    """Run a Python program once for each moment, kill it then, and at last run it to its end."""
    killed = 0
    for seconds in after:
        process = _start(code, arguments)
        time.sleep(seconds)
        killed += process.poll() is None
        process.kill()
        process.communicate()
    finish(code, *arguments)
    return killed


def _start(code: str, arguments: Sequence[str | Path]) -> subprocess.Popen:
    """A process that has printed ``READY``."""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
    process = subprocess.Popen(
        [sys.executable, "-c", code, *map(str, arguments)],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    line = process.stdout.readline()
    assert line.strip() == READY, process.communicate()[1]
    return process
