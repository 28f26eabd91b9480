"""Imports run one way: learn -> simulate -> scenes, and between files and between folders in no circle."""

import ast
import re
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("scenes", "simulate", "learn")
FILES = [path.relative_to(ROOT) for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))]
MODULES = {".".join(path.with_suffix("").parts).removesuffix(".__init__"): path for path in FILES}
FOLDERS = sorted({path.parent for path in FILES})

NAMED = re.compile(rf"(?:{'|'.join(PACKAGES)})(?:\.\w+)+(?=:\w+$|$)")
"""A string that names a module, such as "learn.models.networks.mlp:ResponseMLP"."""


def imported(path: Path) -> set[str]:
    """The modules of ours that a file imports, anywhere in it; a string that names one is an import that is put off."""
    names = set()
    for node in ast.walk(ast.parse((ROOT / path).read_text())):
        if isinstance(node, ast.ImportFrom) and node.module:
            names |= {node.module} | {f"{node.module}.{each.name}" for each in node.names}
        elif isinstance(node, ast.Import):
            names |= {each.name for each in node.names}
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            found = NAMED.match(node.value)
            names |= {found[0]} if found else set()
    return names & MODULES.keys()


def folder(module: str) -> str:
    return ".".join(MODULES[module].parent.parts)


@pytest.mark.parametrize("of", [folder, str], ids=["folders", "files"])
def test_there_is_no_import_circle(of):
    graph: dict[str, set[str]] = {}
    for name, path in MODULES.items():
        graph.setdefault(of(name), set()).update({of(each) for each in imported(path)} - {of(name)})
    assert list(TopologicalSorter(graph).static_order())  # raises CycleError where there is one


@pytest.mark.parametrize(("package", "above"), [("scenes", ("simulate", "learn")), ("simulate", ("learn",))])
def test_no_package_imports_one_above_it(package, above):
    for path in FILES:
        if path.parts[0] == package:
            assert not [name for name in imported(path) if name.split(".")[0] in above], path


def test_one_file_alone_imports_the_ray_tracer():
    """Another import, before that file has found a suitable libLLVM, would make Dr.Jit abort the process."""
    for path in FILES:
        nodes = list(ast.walk(ast.parse((ROOT / path).read_text())))
        names = [alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names]
        names += [node.module or "" for node in nodes if isinstance(node, ast.ImportFrom)]
        found = {name.split(".")[0] for name in names} & {"drjit", "mitsuba", "sionna"}
        assert not found or path.name == "ray_tracer.py", path


@pytest.mark.parametrize("path", FOLDERS, ids=str)
def test_each_folder_says_what_belongs_in_it(path):
    if path.name != "templates":
        assert ast.get_docstring(ast.parse((ROOT / path / "__init__.py").read_text()))


def test_no_two_files_have_the_same_name():
    names = [path.name for path in FILES if path.name != "__init__.py"]
    assert len(names) == len(set(names)), sorted({name for name in names if names.count(name) > 1})
