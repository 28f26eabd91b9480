"""``import bisplat``: light, complete, and every name with an example that runs."""

import doctest
import inspect
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import bisplat

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def workplace(tmp_path_factory) -> Path:
    """A folder with the dataset data/lab and the run runs/lab, which the examples use."""
    folder = tmp_path_factory.mktemp("examples")
    coarse = bisplat.Propagation(max_depth=1, rays=20_000)
    dataset = bisplat.simulate("lab", folder / "data" / "lab", n=40, propagation=coarse)
    bisplat.train(dataset, folder / "runs" / "lab")
    return folder


def run_examples(text: str, name: str) -> int:
    """Run the examples of a docstring; returns how many there are. Fails with doctest's own report."""
    examples = doctest.DocTestParser().get_doctest(text, {"bisplat": bisplat, "np": np}, name, None, 0)
    said: list[str] = []
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE)
    runner.run(examples, out=said.append)
    assert not runner.failures, "".join(said)
    return len(examples.examples)


@pytest.mark.parametrize("name", bisplat.__all__)
def test_every_name_has_an_example_that_runs(name, workplace, monkeypatch):
    monkeypatch.chdir(workplace)
    assert run_examples(inspect.getdoc(getattr(bisplat, name)) or "", name)


def test_the_examples_of_the_package_and_of_what_it_returns_run(workplace, monkeypatch):
    from learn.training.run_folder import Run

    monkeypatch.chdir(workplace)
    for thing in (bisplat, Run):
        assert run_examples(inspect.getdoc(thing) or "", thing.__name__)


def test_the_import_is_light():
    code = "import sys, bisplat; print('\\n'.join(sys.modules))"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT).stdout
    roots = {line.split(".")[0] for line in loaded.splitlines()}
    assert "bisplat" in roots
    assert not roots & {"torch", "drjit", "mitsuba", "sionna", "numpy", "scenes", "simulate", "learn", "tyro"}


def test_help_needs_neither_torch_nor_the_ray_tracer():
    code = (
        "import sys\nfrom bisplat.__main__ import main\nsys.argv = ['bisplat', 'train', '--help']\n"
        "try:\n    main()\nfinally:\n    print('\\n'.join(sys.modules), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 0 and "helmholtz" in done.stdout
    roots = {line.split(".")[0] for line in done.stderr.splitlines()}
    assert not roots & {"torch", "drjit", "mitsuba", "sionna", "scipy", "trimesh", "matplotlib", "lightning"}


def test_names_of_type_checkers_are_the_names_there_are():
    block = (ROOT / "bisplat" / "__init__.py").read_text().split("if TYPE_CHECKING")[1].split("\n\n")[0]
    typed = {line.split(" as ")[-1] for line in block.splitlines() if " import " in line}
    assert typed == set(bisplat.__all__) <= set(dir(bisplat))
    with pytest.raises(AttributeError, match="nothing"):
        _ = bisplat.nothing
