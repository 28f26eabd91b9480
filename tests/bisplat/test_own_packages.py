"""Files of a user with the names of our packages never break ``import bisplat``, in whichever process."""

import json
import os
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

NAMES = ("simulate.py", "learn.py", "scenes.py", "scenes/__init__.py", "simulate/own.py")


def run(folder: Path, *arguments: str) -> str:
    """Standard output of Python in a folder of the user's; the path of bisplat comes after that of the folder."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}
    done = subprocess.run([sys.executable, *arguments], cwd=folder, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def write(path: Path, text: str) -> None:
    """Write a file and the folders above it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(textwrap.dedent(text))


@pytest.fixture
def occupied(tmp_path) -> Path:
    for name in ("simulate.py", "learn.py", "scenes/__init__.py"):
        write(tmp_path / name, "mine = 1")
    return tmp_path


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("script", ["script.py", "simulate.py"])
def test_a_script_beside_such_a_file(tmp_path, name, script):
    write(tmp_path / name, "mine = 1")
    write(tmp_path / script, "import bisplat\nprint(bisplat.load_scene('closet').name, bisplat.check)")
    assert "closet <function" in run(tmp_path, script)


def test_the_command_line(occupied):
    assert "closet" in run(occupied, "-m", "bisplat", "scene", "closet", "--json")


@pytest.mark.parametrize("method", ["spawn", "forkserver", "fork"])
def test_processes_of_multiprocessing(occupied, method):
    write(
        occupied / "script.py",
        f"""
        import multiprocessing
        import bisplat
        if __name__ == "__main__":
            with multiprocessing.get_context("{method}").Pool(1) as pool:
                print([scene.name for scene in pool.map(bisplat.load_scene, ["closet", "lab"])])
        """,
    )
    assert run(occupied, "script.py") == "['closet', 'lab']\n"


def test_pytest(occupied):
    write(
        occupied / "test_mine.py",
        "import bisplat\ndef test_it():\n    assert bisplat.load_scene('closet').name == 'closet'",
    )
    assert "1 passed" in run(occupied, "-m", "pytest", "-q", "-p", "no:cacheprovider")


def test_a_notebook(occupied):
    cells = [{"cell_type": "code", "source": source, "metadata": {}, "outputs": [], "execution_count": None}
             for source in ("import bisplat", "print(bisplat.load_scene('closet').name)")]  # fmt: skip
    notebook = {"cells": cells, "metadata": {}, "nbformat": 4, "nbformat_minor": 4}
    (occupied / "mine.ipynb").write_text(json.dumps(notebook))
    code = (
        "import nbformat, nbclient\nbook = nbformat.read('mine.ipynb', 4)\n"
        "nbclient.NotebookClient(book, resources={'metadata': {'path': '.'}}).execute()\n"
        "print(book.cells[1].outputs[0].text)"
    )
    assert run(occupied, "-c", code).strip() == "closet"


def test_a_module_of_that_name_that_is_imported_already_is_named(occupied):
    code = "import simulate\ntry:\n    import bisplat\nexcept ImportError as error:\n    print(error)"
    said = run(occupied, "-c", code)
    assert str(occupied / "simulate.py") in said and str(ROOT / "simulate") in said and said.count("\n") == 1


def test_what_is_hidden_is_named_when_it_is_looked_for(occupied):
    code = "import bisplat, scenes\ntry:\n    scenes.mine\nexcept AttributeError as error:\n    print(error)"
    said = run(occupied, "-c", code)
    assert str(occupied / "scenes" / "__init__.py") in said and "'mine'" in said


def test_our_own_packages_may_be_imported_first(tmp_path):
    assert run(tmp_path, "-c", "import scenes, bisplat\nprint(bisplat.load_scene('closet').name)") == "closet\n"
