"""Run a command and measure it."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from typing import TypedDict


class Measured(TypedDict):
    """Of a command, from its start to its end.

    Attributes:
        seconds: how long it took.
        peak_gb: its largest memory.
    """

    seconds: float
    peak_gb: float


def measured(*arguments: str, status: int = 0) -> Measured:
    """Run ``bisplat``.

    Args:
        arguments: of the command.
        status: the exit status that it must have.

    Raises:
        RuntimeError: it has another one; the message is what the command said.
    """
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
