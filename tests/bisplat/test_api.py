"""``import bisplat``: light, complete, and every name documented with an example."""

import doctest
import inspect
import re
import subprocess
import sys
from pathlib import Path

import pytest

import bisplat
from scenes.scene import shapes
from scenes.scene.antennas import Gateway

ROOT = Path(__file__).parents[2]
OUR_PACKAGES = re.compile(r"(from|import) (scenes|simulate|learn)\b")
"""An import that users need not write."""


@pytest.mark.parametrize("name", bisplat.__all__)
def test_every_name_has_an_example(name):
    """Of its own, or in a method's docstring; test_docstring_examples.py runs them."""
    thing = getattr(bisplat, name)
    found = doctest.DocTestFinder().find(thing, name, module=inspect.getmodule(thing))
    assert any(each.examples for each in found), f"{name} has no example"
    assert (inspect.getdoc(thing) or "").strip()
    assert not [example.source for each in found for example in each.examples if OUR_PACKAGES.search(example.source)]


def test_the_tutorial_and_the_readme_import_bisplat_alone():
    for page in ("README.md", "docs/start/tutorial.ipynb"):
        assert not OUR_PACKAGES.search((ROOT / page).read_text()), page


HEAVY = {"torch", "drjit", "mitsuba", "sionna", "scipy", "trimesh", "matplotlib", "lightning"}

HELP = "from bisplat.__main__ import main; sys.argv = ['bisplat', 'train', '--help']; main()"

CLOSED_FORM = "import learn.comparison.compare, learn.evaluation.evaluate, learn.training.train"


@pytest.mark.parametrize(
    ("program", "absent"),
    [
        ("import bisplat", HEAVY | {"numpy", "scenes", "simulate", "learn", "tyro"}),
        (HELP, HEAVY),
        (CLOSED_FORM, {"lightning"}),
    ],
)
def test_imports_are_light(program, absent):
    code = f"import sys\ntry:\n    {program}\nfinally:\n    print(*sys.modules, sep='\\n', file=sys.stderr)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 0 and (program != HELP or "helmholtz" in done.stdout), done.stderr
    assert not {line.split(".")[0] for line in done.stderr.splitlines()} & absent


def test_names_are_those_of_the_stub_and_of_nothing_else():
    stub = (ROOT / "bisplat" / "__init__.pyi").read_text()
    typed = [line.split(" as ")[-1] for line in stub.splitlines() if " import " in line]
    assert len(typed) == len(set(typed)) and set(typed) == set(bisplat.__all__) <= set(dir(bisplat))
    assert bisplat.Gateway is Gateway and bisplat.shapes is shapes  # a class, and a module
    with pytest.raises(AttributeError, match="nothing"):
        _ = bisplat.nothing
