"""The examples of CONTRIBUTING.md work, in a copy of the repository in which they were followed."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[1]
BLOCKS = dict(re.findall(r"```(?:python|toml)\n# (\w+/\S+)\n(.*?)```", (ROOT / "CONTRIBUTING.md").read_text(), re.S))
"""What the page says by the file that it belongs in."""

ENGINE_IMPORT = "from simulate.engines.rays_engine import Rays\n"


def replace(path: Path, old: str, new: str) -> None:
    """Replace what stands once in a file."""
    text = path.read_text()
    assert text.count(old) == 1, f"{path.name}: {old}"
    path.write_text(text.replace(old, new))


@pytest.fixture(scope="module")
def followed(tmp_path_factory):
    """A copy of the code in which the page was followed; nothing in the page is left over."""
    root = tmp_path_factory.mktemp("contributing")
    for folder in ("bisplat", "scenes", "simulate", "learn", "benchmarks"):
        shutil.copytree(ROOT / folder, root / folder, ignore=shutil.ignore_patterns("__pycache__"))
    blocks = dict(BLOCKS)

    for new in ("learn/models/level.py", "benchmarks/simulate/sizes.py"):
        assert not (root / new).exists()
        (root / new).write_text(blocks.pop(new))
    sections = root / "benchmarks/ledger/sections.toml"
    sections.write_text(f"{sections.read_text()}\n{blocks.pop('benchmarks/ledger/sections.toml')}")
    for table in ("learn/training/registry.py", "scenes/scene/materials.py"):
        first, rest = blocks.pop(table).split("\n", 1)
        replace(root / table, f"{first}\n", f"{first}\n{rest}")

    places, line = "scenes/places/built_in.py", blocks.pop("scenes/places/built_in.py")
    text = (root / places).read_text()
    shed = re.search(r"def closet.*?\n\n\n(?=\S)", text, re.DOTALL)[0].replace("closet", "shed")
    replace(root / places, "BUILT_IN: dict", f"{shed}BUILT_IN: dict")
    replace(root / places, line.replace(", shed", ""), line)

    engines, line = "simulate/engines/engine_table.py", blocks.pop("simulate/engines/engine_table.py")
    shutil.copy(ROOT / "tests/simulate/engines/free_space.py", root / "simulate/engines/freespace_engine.py")
    replace(root / engines, line.replace(", FreeSpace", ""), line)
    replace(root / engines, ENGINE_IMPORT, f"{ENGINE_IMPORT}from simulate.engines.freespace_engine import FreeSpace\n")
    assert not blocks
    return root


@pytest.fixture(scope="module")
def python(followed):
    """Function: runs Python in the copy -> what it wrote to stdout."""
    environment = {**os.environ, "PYTHONPATH": str(followed), "OMP_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1"}

    def run(*arguments) -> str:
        command = [sys.executable, *map(str, arguments)]
        done = subprocess.run(command, cwd=followed, env=environment, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr[-3000:]
        return done.stdout

    return run


def test_place_engine_and_model(python, followed):
    python("-m", "bisplat", "simulate", "shed", "-o", "data", "-n", 20, "--engine", "freespace")
    made = json.loads((followed / "data" / "metadata.json").read_text())
    assert made["scene"] == "shed" and made["freespace"] == {"loss": 0.0}
    python("-m", "bisplat", "train", "data", "-o", "run", "--model", "level", "--steps", 2)
    assert "ssim_median" in python("-m", "bisplat", "evaluate", "run", "--json")


def test_material(python):
    assert (
        python(
            "-c", "import bisplat; print(bisplat.p2040_materials(['clear_acrylic'], 2e11)['clear_acrylic'].thickness)"
        )
        == "0.005\n"
    )


def test_measured_figure(python, followed):
    figures = python("-m", "benchmarks.simulate.sizes", "--json")
    (followed / "runs").mkdir()
    (followed / "runs" / "sizes.json").write_text(figures)
    (followed / "docs" / "generated").mkdir(parents=True)
    python("-m", "benchmarks.results")
    page = (followed / "docs" / "generated" / "measurements.md").read_text()
    assert "| lab |" in page.split("## Sizes of the built-in places\n")[1]
