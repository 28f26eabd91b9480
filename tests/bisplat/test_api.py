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


def test_the_import_is_light():
    code = "import sys, bisplat; print('\\n'.join(sys.modules))"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT).stdout
    roots = {line.split(".")[0] for line in loaded.splitlines()}
    assert "bisplat" in roots
    assert not roots & {"torch", "drjit", "mitsuba", "sionna", "numpy", "scenes", "simulate", "learn", "tyro"}


def test_help_needs_neither_torch_nor_the_ray_tracer_nor_scipy():
    code = (
        "import sys\nfrom bisplat.__main__ import main\nsys.argv = ['bisplat', 'train', '--help']\n"
        "try:\n    main()\nfinally:\n    print('\\n'.join(sys.modules), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 0 and "helmholtz" in done.stdout
    roots = {line.split(".")[0] for line in done.stderr.splitlines()}
    assert not roots & {"torch", "drjit", "mitsuba", "sionna", "scipy", "trimesh", "matplotlib", "lightning"}


def test_names_are_those_of_the_stub_and_of_nothing_else():
    stub = (ROOT / "bisplat" / "__init__.pyi").read_text()
    typed = [line.split(" as ")[-1] for line in stub.splitlines() if " import " in line]
    assert len(typed) == len(set(typed)) and set(typed) == set(bisplat.__all__) <= set(dir(bisplat))
    assert bisplat.Gateway is Gateway and bisplat.shapes is shapes  # a class, and a module
    with pytest.raises(AttributeError, match="nothing"):
        _ = bisplat.nothing


def test_training_in_closed_form_needs_no_lightning():
    """It takes seconds to import, and only training by steps uses it."""
    code = (
        "import sys\nimport learn.comparison.compare\nimport learn.evaluation.evaluate\nimport learn.training.train\n"
        "print('lightning' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT)
    assert (done.returncode, done.stdout) == (0, "False\n")
