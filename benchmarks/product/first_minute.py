"""How soon does ``bisplat demo`` show something, and when is its report whole?

python -m benchmarks.product.first_minute --json

Measured: seconds from the start of the command until the report shows the room, until it shows the first traced
spectra, and until it is whole; and the processor time of it all. The smallest run ends when the page shows the room.
"""

from __future__ import annotations

import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import tyro

from benchmarks.ledger.printing import print_figures

PATIENCE = 600.0
"""Seconds until the benchmark gives up."""


def main(
    smallest: bool = False,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Start the demo, and wait for its pictures."""
    figures: dict[str, float | None] = {}
    with tempfile.TemporaryDirectory() as folder:
        began = time.perf_counter()
        command = [sys.executable, "-m", "bisplat", "demo", "-o", folder]
        demo = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        page, spectra = Path(folder) / "report.html", Path(folder) / "first_look.png"
        figures["seconds to the room"] = seconds_until(page.is_file, began, demo)
        shown = None if smallest else seconds_until(lambda: spectra.is_file() and newer(page, spectra), began, demo)
        figures["seconds to the first spectra"] = shown
        whole = Path(folder) / "metrics.json"
        figures["seconds to the whole report"] = None if smallest else seconds_until(whole.is_file, began, demo)
        demo.send_signal(signal.SIGINT)
        demo.wait()
        of_demo = resource.getrusage(resource.RUSAGE_CHILDREN)
        figures["seconds of processor time"] = None if smallest else round(of_demo.ru_utime + of_demo.ru_stime, 1)
    print_figures(figures, json_output, smallest)


def newer(page: Path, picture: Path) -> bool:
    """Whether the page was written after the picture."""
    return page.stat().st_mtime >= picture.stat().st_mtime


def seconds_until(there: Callable[[], bool], began: float, demo: subprocess.Popen) -> float:
    """Seconds from ``began`` until ``there()`` is true."""
    while not there():
        if demo.poll() is not None or time.perf_counter() - began > PATIENCE:
            raise SystemExit("first_minute: expected the demo's page, found none")
        time.sleep(0.1)
    return round(time.perf_counter() - began, 1)


if __name__ == "__main__":
    tyro.cli(main)
