"""Imports run one way: learn -> simulate -> scenes, and in learn/ in no circle."""

import ast
import re
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
MODULES = {".".join(path.relative_to(ROOT).with_suffix("").parts): path for path in ROOT.glob("learn/**/*.py")}

DOTTED = re.compile(r"(scenes|simulate|learn)(\.\w+)+(:\w+)?")
"""A string like "learn.training.registry" or "learn.twin.twin_model:Twin"."""


def imported(path: Path) -> set[str]:
    """Names of the modules a file imports, anywhere in it; a string that names one of ours is an import put off."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.module:
            names |= {node.module} | {f"{node.module}.{each.name}" for each in node.names}
        elif isinstance(node, ast.Import):
            names |= {each.name for each in node.names}
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and DOTTED.fullmatch(node.value):
            names.add(node.value.partition(":")[0])
    return names


@pytest.mark.parametrize("depth", [2, None], ids=["packages", "modules"])
def test_learn_has_no_import_circle(depth):
    graph: dict[str, set[str]] = {}
    for name, path in MODULES.items():
        importer = ".".join(name.split(".")[:depth])
        found = {".".join(each.split(".")[:depth]) for each in imported(path) & MODULES.keys()}
        graph.setdefault(importer, set()).update(found - {importer})
    assert list(TopologicalSorter(graph).static_order())  # raises CycleError where there is one


@pytest.mark.parametrize(("package", "unknown"), [("scenes", ("simulate", "learn")), ("simulate", ("learn",))])
def test_no_package_imports_one_above_it(package, unknown):
    for path in (ROOT / package).rglob("*.py"):
        assert not [name for name in imported(path) if name.split(".")[0] in unknown], path
