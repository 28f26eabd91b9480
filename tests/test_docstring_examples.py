"""The examples in the docstrings of all modules do what they say, in a folder with data/lab and runs/lab."""

import doctest
import importlib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
MODULES = [
    ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
    for package in ("bisplat", "scenes", "simulate", "learn")
    for path in sorted((ROOT / package).rglob("*.py"))
    if ">>> " in path.read_text()
]


@pytest.mark.parametrize("name", MODULES)
@pytest.mark.usefixtures("quick_fits")
def test_examples_are_true(name, workplace, monkeypatch):
    monkeypatch.chdir(workplace)
    flags = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
    result = doctest.testmod(importlib.import_module(name), optionflags=flags)
    assert result.attempted and not result.failed
