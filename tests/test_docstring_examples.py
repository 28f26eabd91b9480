"""The examples in the docstrings of all modules do what they say."""

import doctest
import importlib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
NEED_A_RUN = {
    "learn.comparison.ablate",
    "learn.comparison.compare",
    "learn.comparison.sweep",
    "learn.evaluation.check",
    "learn.evaluation.crossvalidate",
    "learn.evaluation.evaluate",
}
"""Modules whose examples need a dataset data/lab and a run runs/lab in the current directory."""

MODULES = [
    ".".join(path.relative_to(ROOT).with_suffix("").parts)
    for package in ("scenes", "simulate", "learn")
    for path in sorted((ROOT / package).rglob("*.py"))
    if ">>> " in path.read_text()
]


@pytest.mark.parametrize("name", [name for name in MODULES if name not in NEED_A_RUN])
def test_examples_are_true(name):
    result = doctest.testmod(importlib.import_module(name))
    assert result.attempted and not result.failed
