"""Runs ``bisplat`` commands, each in a fork of one process that has imported everything: in milliseconds, not seconds.

Run as a program, it reads one request per line from stdin (JSON: arguments, folder) and answers each with a line on
stdout (JSON: status, seconds, megabytes, said). A command that takes too long or too much memory is killed.
"""

from __future__ import annotations

import importlib
import json
import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

LONGEST = 10.0  # Seconds of the processor in which a command has to refuse

LONGEST_WORK = 3 * LONGEST
"""Seconds of the processor after which a command counts as hanging. An export to ONNX alone takes 7 to 10."""

PATIENCE = 2 * LONGEST_WORK
"""Seconds after which a command counts as hanging even if it waits; other programs may take the processor meanwhile."""

MOST_MEMORY = 4096  # Megabytes that a command may take


MODULES = """
torch
trimesh
lightning.pytorch
matplotlib.pyplot
bisplat.__main__
learn.training.train
learn.comparison.compare
learn.evaluation.check
learn.evaluation.evaluate
scenes.drawing.scene_drawing
learn.reports.comparison_report
learn.reports.evaluation_report
scenes.importing.mesh_import
simulate.generation.generate
simulate.exchange.convert
simulate.dataset.responses_file
simulate.rays.tracer
""".split()
"""What the commands import when they need it."""


@dataclass(frozen=True)
class Ended:
    """How a command ended."""

    status: int  # exit status; negative: the signal that ended it
    seconds: float  # time of the processor
    megabytes: float  # largest memory
    said: str  # what it wrote on stderr
    hung: bool  # whether it was killed, since it took too long


class ForkServer:
    """A process that runs commands for us, as a context."""

    def __init__(self, temporary: Path, settings: Path) -> None:
        self._folders = {"TMPDIR": str(temporary), "MPLCONFIGDIR": str(settings)}

    def __enter__(self) -> ForkServer:
        environment = os.environ | self._folders
        environment |= {"OMP_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1", "COLUMNS": "200"}
        environment["PYTHONPATH"] = os.pathsep.join(path for path in sys.path if path)
        environment.pop("BISPLAT_TRACEBACK", None)
        self._process = subprocess.Popen(
            [sys.executable, __file__], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment
        )
        return self

    def __exit__(self, *_) -> None:
        self._process.communicate()

    def run(self, arguments: Sequence[str], folder: Path) -> Ended:
        """Run a command."""
        assert self._process.stdin is not None and self._process.stdout is not None
        print(json.dumps([list(arguments), str(folder)]), file=self._process.stdin, flush=True)
        return Ended(**json.loads(self._process.stdout.readline()))


def _in_a_fork(arguments: list[str], folder: str) -> Ended:
    with tempfile.TemporaryFile() as said:
        process = os.fork()
        if process == 0:
            _be_the_command(arguments, folder, said.fileno())
        began, hung, status, usage = time.monotonic(), False, None, None
        while status is None:
            ended, code, usage = os.wait4(process, os.WNOHANG)
            if ended:
                status = os.waitstatus_to_exitcode(code)
            else:
                elapsed = time.monotonic() - began
                hung = hung or elapsed > PATIENCE
                if hung or _megabytes(process) > MOST_MEMORY:
                    os.killpg(process, signal.SIGKILL)
                time.sleep(0.002 if elapsed < 1 else 0.02)
        hung = hung or status == -signal.SIGXCPU
        said.seek(0)
        text = said.read(10**6).decode(errors="replace")
    seconds = usage.ru_utime + usage.ru_stime
    return Ended(status, round(seconds, 3), usage.ru_maxrss / 1024, text, hung)


def _be_the_command(arguments: list[str], folder: str, said: int) -> None:
    """In the fork: never returns."""
    status = 70  # of a defect in this function
    try:
        os.setpgid(0, 0)
        nothing = os.open(os.devnull, os.O_RDWR)
        for descriptor, target in ((nothing, 0), (nothing, 1), (said, 2)):
            os.dup2(descriptor, target)
        os.chdir(folder)
        resource.setrlimit(resource.RLIMIT_CPU, (int(LONGEST_WORK), int(LONGEST_WORK) + 1))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        sys.argv = ["bisplat", *arguments]
        sys.stdin, sys.stdout = open(0), open(1, "w")
        sys.stderr = open(2, "w", errors="backslashreplace")
        sys.__stderr__ = sys.stderr
        from bisplat.__main__ import main

        try:
            status = main() or 0
        except SystemExit as end:
            status = end.code if isinstance(end.code, int) else int(end.code is not None)
        except BaseException:  # noqa: BLE001 - it is what we look for
            traceback.print_exc()
            status = 71
        sys.stderr.flush()
    finally:
        os._exit(status)


def _megabytes(process: int) -> float:
    pages = Path(f"/proc/{process}/statm").read_text().split()
    return int(pages[1]) * resource.getpagesize() / 2**20 if pages else 0.0


def _import_everything() -> None:
    """Import ``MODULES``."""
    import torch

    for module in MODULES:
        importlib.import_module(module)
    torch.set_num_threads(1)


def serve() -> None:
    """Answer requests until stdin ends."""
    answers = os.fdopen(os.dup(1), "w")
    _import_everything()
    for line in sys.stdin:
        print(json.dumps(vars(_in_a_fork(*json.loads(line)))), file=answers, flush=True)


if __name__ == "__main__":
    serve()
