"""The wheel holds everything: built, installed without the checkout, and used."""

import os
import shutil
import subprocess
import sys
import sysconfig
import venv
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[1]


def run(*command, **options) -> str:
    done = subprocess.run([*map(str, command)], capture_output=True, text=True, **options)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """Function: runs a program of a fresh environment that has the wheel, and this one's packages beside it."""
    folder = tmp_path_factory.mktemp("wheel")
    leave = shutil.ignore_patterns(".*", "runs", "build", "tests", "docs", "*.egg-info", "__pycache__")
    shutil.copytree(ROOT, folder / "source", ignore=leave)  # building leaves files beside the sources
    alone = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    run(sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "-w", folder, folder / "source", env=alone)
    (wheel,) = folder.glob("*.whl")
    venv.create(folder / "fresh", with_pip=True)
    programs = folder / "fresh" / "bin"
    run(programs / "python", "-m", "pip", "install", "--quiet", "--no-deps", wheel, env=alone)
    # The checkout is installed here by a .pth file, which Python reads in its own site-packages only.
    environment = {**os.environ, "PYTHONPATH": sysconfig.get_paths()["purelib"], "OMP_NUM_THREADS": "1"}
    return lambda program, *arguments: run(programs / program, *arguments, cwd=folder, env=environment)


def test_the_wheel_is_used_without_the_checkout(installed):
    homes = installed(
        "python", "-c", "import bisplat, learn, scenes, simulate; print(bisplat, learn, scenes, simulate)"
    )
    assert str(ROOT) not in homes and homes.count("site-packages") == 4
    assert "simulate" in installed("bisplat", "--help")
    assert "lab" in installed("bisplat", "scene", "lab", "--json")
    installed("bisplat", "simulate", "bedroom", "-o", "data", "-n", "12", "--max-depth", "0")
    installed("bisplat", "train", "data", "-o", "run")
    installed("bisplat", "evaluate", "run")  # its page needs the templates


def test_types_are_found_in_the_wheel(installed):
    installed("python", "-c", "from pathlib import Path; import bisplat, learn, scenes, simulate\n"
              "for package in (bisplat, learn, scenes, simulate):\n"
              "    assert (Path(package.__file__).parent / 'py.typed').is_file(), package")  # fmt: skip
