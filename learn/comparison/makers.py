"""Functions that make new, unfitted methods, from what a user gives: names, classes, functions or objects."""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from typing import Any

from learn.comparison.own_method import built
from learn.models.model_settings import MINUTES_MOST, STEPS_MOST
from learn.training.registry import own_class
from scenes.files.errors import (
    ParameterError,
    require_instance,
    require_positive,
    require_whole,
    require_within,
    require_word,
    shown,
)
from simulate.positions.positions import MOST_POSITIONS

SEEDS_MOST = 1000
"""Largest number of fits of each method."""


def makers(
    given: Any, find: Callable[[str], Callable[[], Any]], parameter: str, label: Callable[[str], str] = str
) -> dict[str, Callable[[], Any]]:
    """Functions that make new, unfitted methods, by the label of their rows."""
    if isinstance(given, str) or not isinstance(given, Iterable):
        raise ParameterError(parameter, f"expected a list of names, or methods by label, found {shown(given)}")
    given = given if isinstance(given, Mapping) else list(given)
    if not given:
        raise ParameterError(parameter, "expected at least one method, found none")
    if isinstance(given, Mapping):
        found = {}
        for name, each in given.items():
            reduced = label(each).removeprefix(each) if isinstance(each, str) else ""
            found[f"{name}{reduced}"] = _maker(name, each, find, parameter)
    else:
        for name in given:
            require_instance(str, **{parameter: name})
        found = {label(name): find(name) for name in given}
    for name, make in found.items():
        built(name, make, parameter)  # refuses it now rather than after hours of other rows
    return found


def _maker(name: Any, given: Any, find: Callable[[str], Callable[[], Any]], parameter: str) -> Callable[[], Any]:
    if isinstance(given, str):
        return find(given)
    if not isinstance(given, type) and hasattr(given, "fit"):
        return partial(copy.deepcopy, given)
    if not callable(given):
        raise ParameterError(parameter, f"expected a method with fit and predict for {name}, found {shown(given)}")
    return given


def chosen(given: Any, known: Mapping[str, Callable[[], Any]]) -> dict[str, Callable[[], Any]]:
    """The methods of a comparison of powers or channels that are given as ``methods``, by label.

    The label of a method of reduced size ends in "(reduced)".

    >>> class Learned:
    ...     by_steps = True
    >>> list(chosen(None, {"text": str, "learned": Learned}))
    ['text']
    """
    if given is None:
        return {name: make for name, make in known.items() if not trained_by_steps(make)}

    def find(name: str) -> Callable[[], Any]:
        if name.partition(":")[2]:
            return own_class(name, "methods")
        require_word([*known, "module:Class"], methods=name)
        return known[name]

    def label(name: str) -> str:
        return f"{name} (reduced)" if name in known and getattr(known[name](), "reduced", False) else name

    return makers(given, find, "methods", label)


def trained_by_steps(make: Callable[[], Any]) -> bool:
    """Whether a method is trained by steps, for as many minutes as it is given: its class states ``by_steps``."""
    return bool(getattr(make, "by_steps", False))


def check_effort(budget: float, seeds: int, steps: int | None = None) -> None:
    """Refuse a budget, a number of steps or a number of seeds that is out of its range."""
    if steps is not None:
        require_whole(1, STEPS_MOST, steps=steps)
    require_positive(budget=budget)
    require_within(0, MINUTES_MOST, "minutes", budget=budget)
    require_whole(1, SEEDS_MOST, seeds=seeds)


def checked_sizes(what: str, **sizes: Any) -> list[int]:
    """Sizes of training parts, rising.

    >>> checked_sizes("positions", sizes=(200, 50))
    [50, 200]
    """
    ((name, given),) = sizes.items()
    if isinstance(given, str) or not isinstance(given, Iterable):
        raise ParameterError(name, f"expected a list of numbers of training {what}, found {shown(given)}")
    found = list(given)
    for size in found:
        require_whole(1, MOST_POSITIONS, **{name: size})
    if not found or len(set(found)) < len(found):
        raise ParameterError(name, f"expected different numbers of training {what}, found {shown(found)}")
    return sorted(found)
