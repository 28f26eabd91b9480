"""What the benchmarks' tests share: a way to run one as typed in the documentation, a small dataset, a short run."""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def _run(*arguments: str | Path) -> str:
    """Python with these arguments, from the repository's root, on one thread; what it wrote to stdout."""
    done = subprocess.run(
        [sys.executable, *map(str, arguments)],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr[-3000:]
    return done.stdout


@pytest.fixture(scope="session")
def run_python() -> Callable[..., str]:
    """Function: arguments of Python -> what it wrote to stdout; it must end with status 0."""
    return _run


@pytest.fixture(scope="session")
def small_dataset(tmp_path_factory) -> Path:
    """A dataset of 48 spectra of the bedroom, traced with few rays."""
    folder = tmp_path_factory.mktemp("benchmarks") / "bedroom"
    _run(
        "-m",
        "bisplat",
        "simulate",
        "bedroom",
        "-o",
        folder,
        "-n",
        "48",
        "--max-depth",
        "1",
        "--rays",
        "20000",
        "--no-diffraction",
    )
    return folder


@pytest.fixture(scope="session")
def short_run(tmp_path_factory, small_dataset) -> Path:
    """A run of two steps on the small dataset."""
    folder = tmp_path_factory.mktemp("benchmarks") / "run"
    _run("-m", "bisplat", "train", small_dataset, "-o", folder, "--model", "bisplat-aperture", "--steps", "2")
    return folder
