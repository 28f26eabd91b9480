"""Whoever has measured data needs no ray tracer: with Sionna, Mitsuba and Dr.Jit forbidden everything else works."""

import os
import subprocess
import sys

import pytest

PROGRAM = '''
import sys

class Forbidden:
    """Import hook: as if the ray tracer were not installed."""

    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in ("drjit", "mitsuba", "sionna"):
            raise ModuleNotFoundError(f"the ray tracer is forbidden here: {name}", name=name)

sys.meta_path.insert(0, Forbidden())
for name in ("drjit", "mitsuba", "sionna.rt"):
    try:
        __import__(name)
    except ModuleNotFoundError:
        continue
    raise SystemExit(f"{name} was not forbidden")

import dataclasses
import bisplat
import learn.evaluation.crossvalidate, learn.training.by_steps
from bisplat.__main__ import main
from learn.training.registry import MODELS

folder = sys.argv[1]
small = dict(primitives=40, width=16)
MODELS["bisplat-aperture"] = dataclasses.replace(MODELS["bisplat-aperture"], options=small)
learn.training.by_steps.STEPS_PER_VALIDATION = 1
run = f"{folder}/run"
for command in (
    ["check", f"{folder}/data"],
    ["train", f"{folder}/data", "-o", run, "--model", "bisplat-aperture", "--steps", "2", "--batch-size", "8"],
    ["evaluate", run],
    ["predict", run, "--positions", f"{folder}/data/tx_pos.csv", "-o", f"{folder}/out.npz"],
):
    sys.argv = ["bisplat", *command]
    main()
'''


@pytest.mark.slow
def test_measured_data_is_checked_learned_and_predicted_without_a_ray_tracer(tmp_path, write_folder):
    folder = write_folder(tmp_path / "data")
    assert not (folder / "metadata.json").exists() and not (folder / "channels.npz").exists()
    environment = os.environ | dict.fromkeys(("OMP_NUM_THREADS", "NUMBA_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
    command = [sys.executable, "-c", PROGRAM, str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, env=environment, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "run" / "evaluation" / "metrics.json").is_file()
    assert (tmp_path / "out.npz").is_file()
