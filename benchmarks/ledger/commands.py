"""Run a command and measure it."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from typing import TypedDict


class Measured(TypedDict):
    """Of a command, from its start to its end."""

    seconds: float  # how long it took
    peak_gb: float  # its largest memory


def measured(*arguments: str, status: int = 0) -> Measured:
    """Run ``bisplat``."""
    began = time.perf_counter()
    with tempfile.TemporaryFile() as said:
        process = subprocess.Popen([sys.executable, "-m", "bisplat", *arguments], stdout=said, stderr=said)
        _, code, usage = os.wait4(process.pid, 0)
        seconds = time.perf_counter() - began
        process.returncode = os.waitstatus_to_exitcode(code)
        said.seek(0)
        if process.returncode != status:
            raise RuntimeError(f"{' '.join(arguments)}: {said.read().decode()}")
    return {"seconds": round(seconds, 2), "peak_gb": round(usage.ru_maxrss * 1024 / 1e9, 2)}
