"""A reader's machine: ``bisplat`` and ``python`` on the path, and the files that a reader brings."""

import math
import os
import shutil
import stat
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import trimesh

from scenes.places.built_in import lab
from tests.docs.pages import ROOT

SMALL = ROOT / "tests" / "docs" / "small_size.py"

PIP = """
cd "{root}" && shift && said=$("{python}" -m pip install --dry-run --no-deps "$@" 2>&1) || {{ echo "$said"; exit 1; }}
case "$said" in *"not provide the extra"*) echo "$said"; exit 1;; esac
"""
"""``pip install`` as far as it can go without changing the environment: the project builds, and has the extras."""


@pytest.fixture(scope="session")
def environment(tmp_path_factory) -> dict[str, str]:
    """The environment of a shell in which ``bisplat`` is the command at a small size."""
    programs = tmp_path_factory.mktemp("bin")
    lines = {
        "bisplat": f'exec "{sys.executable}" "{SMALL}" "$@"',
        "python": f'exec "{sys.executable}" "$@"',
        "make": f'exec {shutil.which("make")} --dry-run -C "{ROOT}" "$@"',  # the target must exist
        "pip": PIP.format(python=sys.executable, root=ROOT),
    }
    for name, line in lines.items():
        program = programs / name
        program.write_text(f"#!/bin/sh\n{line}\n")
        program.chmod(program.stat().st_mode | stat.S_IXUSR)
    return {
        **os.environ,
        "PATH": f"{programs}:{os.environ['PATH']}",
        "PYTHONPATH": str(ROOT),
        "OMP_NUM_THREADS": "1",
        "NUMBA_NUM_THREADS": "1",
        "BROWSER": "true",
        "MPLBACKEND": "agg",
    }


@pytest.fixture
def folder(tmp_path, write_folder) -> Path:
    """An empty folder but for what a reader brings: a mesh, places to predict at, and measured spectra."""
    (tmp_path / "tests").symlink_to(ROOT / "tests")  # tests/data has fields in full wave, which pages use
    place = lab()
    room = trimesh.Scene()
    y_up = trimesh.transformations.rotation_matrix(-math.pi / 2, [1, 0, 0])  # glTF has y up
    for each in place.objects:
        room.add_geometry(each.mesh, node_name=each.name.capitalize(), geom_name=each.name, transform=y_up)
    room.export(tmp_path / "room.glb")
    (tmp_path / "places.csv").write_text("x,y,z\n2.1,2.9,1.2\n2.4,3.1,1.1\n")
    write_folder(tmp_path / "data" / "rfid-s23-160", count=60)
    return tmp_path


@pytest.fixture
def shell(environment, folder) -> Callable[[str], None]:
    """Function: runs commands in the folder, as typed; the first that fails is an error with what it said."""

    def run(text: str) -> None:
        done = subprocess.run(
            ["bash", "-e", "-o", "pipefail", "-c", text], cwd=folder, env=environment, capture_output=True, text=True
        )
        assert done.returncode == 0, f"{text}\n{done.stdout[-2000:]}\n{done.stderr[-3000:]}"

    return run


@pytest.fixture
def undo_small_sizes() -> Iterator[None]:
    """After a test, models and the functions of ``bisplat`` are as they were."""
    import bisplat
    from learn.models.kriging import stacking, vecchia
    from learn.training import validation_part as epochs
    from learn.training.registry import MODELS

    functions = {name: getattr(bisplat, name) for name in bisplat.__all__}
    models, period = dict(MODELS), epochs.STEPS_PER_VALIDATION
    iterations, folds = vecchia.ITERATIONS, stacking.FOLDS
    yield
    for name, function in functions.items():
        setattr(bisplat, name, function)
    MODELS.update(models)
    epochs.STEPS_PER_VALIDATION = period
    vecchia.ITERATIONS, stacking.FOLDS = iterations, folds
