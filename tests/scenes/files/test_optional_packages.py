"""What the code says of extras is what pyproject.toml and constraints.txt have."""

import pickle
import re
import tomllib
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest

from scenes.files import optional_packages
from scenes.files.errors import InputError
from scenes.files.optional_packages import EXTRAS, require_extra

ROOT = Path(__file__).parents[3]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
OPTIONAL = PROJECT["optional-dependencies"]

NOT_IMPORTED = {"onnx": {"onnxruntime"}}
"""Distributions of an extra that no code of ours imports: this one runs what is exported."""


def distribution(requirement: str) -> str:
    """The name of what a line of pyproject.toml or constraints.txt asks for, as package indexes compare names."""
    return re.sub(r"[-_.]+", "-", re.match(r"[\w.-]+", requirement)[0]).lower()


@pytest.mark.parametrize("name", EXTRAS)
def test_an_extra_has_the_distributions_of_the_modules_that_the_code_looks_for(name):
    providers = packages_distributions()
    needed = {distribution(each) for module in EXTRAS[name].modules for each in providers[module]}
    given = {distribution(each) for each in OPTIONAL[name]}
    assert given == needed | NOT_IMPORTED.get(name, set())


def test_all_has_every_extra_and_the_core_has_none():
    (everything,) = OPTIONAL["all"]
    assert set(re.findall(r"\w+", everything.partition("[")[2])) == EXTRAS.keys()
    core = {distribution(each) for each in PROJECT["dependencies"]}
    assert not core & {distribution(each) for name in EXTRAS for each in OPTIONAL[name]}


def test_everything_that_pyproject_names_is_pinned():
    pinned = {distribution(line) for line in (ROOT / "constraints.txt").read_text().splitlines()}
    named = {distribution(each) for group in (PROJECT["dependencies"], *OPTIONAL.values()) for each in group}
    assert named - pinned == {"bisplat-wrf", "triton"}  # torch for GPUs asks for a triton of its own


def test_a_missing_extra_is_one_sentence(monkeypatch):
    monkeypatch.setattr(optional_packages, "find_spec", lambda module: None if module == "websockets" else object())
    require_extra("rays", "ray tracing")
    with pytest.raises(InputError) as caught:
        require_extra("viewer", "the viewer")
    assert "bisplat-wrf[viewer]" in str(caught.value) and isinstance(caught.value, ImportError)
    assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)  # between processes
