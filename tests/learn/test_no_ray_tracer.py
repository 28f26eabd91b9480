"""Learning from a measured folder needs no ray tracer: not Dr.Jit, not Mitsuba, not Sionna."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]

PROGRAM = """
import sys

class Forbidden:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in ("drjit", "mitsuba", "sionna"):
            raise ImportError(f"{name} was imported")

sys.meta_path.insert(0, Forbidden())
import learn.run
from learn.model import ModelSize
learn.run.ModelSize = lambda: ModelSize(20, 16, 8, 1, 1, 2, 8)
import bisplat

data, run, places, out = sys.argv[1:]
for arguments in (
    ["check", data],
    ["train", data, "-o", run, "--steps", "2", "--batch-size", "8"],
    ["evaluate", run],
    ["predict", run, "--positions", places, "-o", out],
):
    sys.argv = ["bisplat", *arguments]
    try:
        bisplat.main()
    except SystemExit as stop:
        if stop.code:
            raise
print("all done")
"""


def test_a_measured_folder_is_learned_without_it(tiny, tmp_path):
    (tmp_path / "places.csv").write_text("x,y,z\n1,0.5,1\n")
    arguments = [tiny, tmp_path / "run", tmp_path / "places.csv", tmp_path / "out.npz"]
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, *map(str, arguments)], cwd=ROOT, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.endswith("all done\n")
    assert (tmp_path / "out.npz").exists()


def test_tracing_does_import_it():
    """So that the test above can fail."""
    program = PROGRAM.split("import learn.run")[0] + "import simulate.trace"
    done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode != 0 and "drjit was imported" in done.stderr
