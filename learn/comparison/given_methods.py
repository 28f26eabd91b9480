"""Functions that make new, unfitted methods from what a user gives, and what tells when a method is another one."""

from __future__ import annotations

import ast
import copy
import hashlib
import inspect
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from learn.comparison.predictions import Predictions
from learn.models.model_settings import MINUTES_MOST, STEPS_MOST
from learn.training.registry import MODELS, in_one_sentence, own_class, what_happened
from learn.training.registry import is_own as is_own_class
from scenes.files.errors import (
    ParameterError,
    require_instance,
    require_positive,
    require_whole,
    require_within,
    shown,
)
from simulate.positions.positions import MOST_POSITIONS


def built(label: str, make: Callable[[], Any]) -> Any:
    """Make a new, unfitted method."""
    try:
        method = make()
    except (Exception, SystemExit) as error:
        expected = f"expected a class that can be built without arguments for {label}"
        raise ParameterError("methods", f"{expected}, found {what_happened(error)}") from error
    lacking = [name for name in ("fit", "predict") if not callable(getattr(method, name, None))]
    if lacking:
        found = f"{type(method).__name__} without {' and '.join(lacking)}"
        raise ParameterError("methods", f"expected a method with fit and predict for {label}, found {found}")
    return method


@contextmanager
def named(label: str, method: Any, expected: str) -> Iterator[None]:
    """Turn errors of a user's method into a sentence that names it. Errors of our own methods pass."""
    with in_one_sentence(label, expected) if is_own(method) else nullcontext():
        yield


def is_own(method: Any) -> bool:
    """Whether a method is of a class that the user wrote, or trains a model that the user wrote."""
    return is_own_class(_class_of(method))


def source_hash(method: Any) -> str | None:
    """A hash of the source and of the settings of a method that the user wrote.

    The source is that of the class and of the module it is in; of a script, it is that of the script's classes,
    functions, imports and constants. Comments and layout do not count, nor do other modules. The settings are
    ``plain_settings``.
    """
    source = _source(_class_of(method))
    if source is None:
        return None
    return hashlib.sha256(f"{source}\n{sorted(plain_settings(method).items())!r}".encode()).hexdigest()[:16]


def source_of(label: str, method: Any, usual: Mapping[str, Callable[[], Any]]) -> str | None:
    """A hash of what a method is, which tells when a row has to be measured again."""
    if is_own(method):
        return source_hash(method)
    make, found = usual.get(label.removesuffix(" (reduced)")), _in_words(method)
    if make is not None and _in_words(make()) == found:
        return getattr(method, "source", None)  # of the twin, whose scene the label does not say
    return hashlib.sha256(found.encode()).hexdigest()[:16]


def _in_words(method: Any) -> str:
    """The class of one of our methods, its settings, and the weights that its training starts from."""
    settings = plain_settings(method)
    init = settings.pop("init", None)
    weights = "" if init is None else hashlib.sha256((Path(init) / "weights.safetensors").read_bytes()).hexdigest()
    return f"{type(method).__name__} {sorted(settings.items())!r} {weights}"


def plain_settings(method: Any) -> dict[str, Any]:
    """Those attributes of an unfitted method that are numbers, texts, or lists and dictionaries of them, by name."""
    return {name: value for name, value in getattr(method, "__dict__", {}).items() if _is_plain(value)}


def _class_of(method: Any) -> type:
    """The class of a method, or that of the model which it trains."""
    return getattr(method, "model_class", type(method))


@cache  # as it was when the class was first used: the file may change later without the loaded class
def _source(own: type) -> str | None:
    """The source of a class with that of its module. None: it is not known."""
    module = sys.modules.get(own.__module__)
    text = f"{own.__module__}:{own.__qualname__}\n"
    try:
        of_module = ast.parse(inspect.getsource(module)) if module is not None and hasattr(module, "__file__") else None
    except (OSError, TypeError, SyntaxError):
        of_module = None
    if of_module is not None:
        if own.__module__ == "__main__":
            of_module.body = [statement for statement in of_module.body if _defines(statement)]
        return text + ast.unparse(of_module)
    functions = [each for each in vars(own).values() if inspect.isfunction(each)]  # of a cell of a notebook
    try:
        return text + "".join(inspect.getsource(each) for each in functions) if functions else None
    except (OSError, TypeError):
        return None


def _defines(statement: ast.stmt) -> bool:
    """Whether a statement of a script defines something that a class may use, rather than doing something."""
    if isinstance(statement, ast.Assign):
        return all(isinstance(each, _VALUES) for each in ast.walk(statement.value))
    return isinstance(statement, ast.FunctionDef | ast.ClassDef | ast.Import | ast.ImportFrom)


_VALUES = (ast.Constant, ast.List, ast.Tuple, ast.Dict, ast.UnaryOp, ast.unaryop, ast.expr_context)


def _is_plain(value: Any) -> bool:
    if isinstance(value, list | tuple):
        return all(map(_is_plain, value))
    if isinstance(value, dict):
        return all(_is_plain(each) for pair in value.items() for each in pair)
    return value is None or isinstance(value, bool | int | float | str | np.generic)


SEEDS_MOST = 1000  # Largest number of fits of each method


def chosen_methods(
    given: Any, known: Mapping[str, Callable[[], Any]], usual: Sequence[str], models: bool
) -> dict[str, Callable[[], Any]]:
    """Functions that make new, unfitted methods, by the label of their rows.

    A method is given as a name, a class, a function or an object; a class of the user's by its place "module:Class",
    which with ``models`` may be one of ``bisplat.SpectrumModel``; and the predictions of another program as
    "LABEL=FOLDER".
    """
    if given is None:
        given = usual
    if isinstance(given, str) or not isinstance(given, Iterable):
        raise ParameterError("methods", f"expected a list of names, or methods by label, found {shown(given)}")
    given = given if isinstance(given, Mapping) else list(given)
    if not given:
        raise ParameterError("methods", "expected at least one method, found none")
    if isinstance(given, Mapping):
        makes = {name: _factory(name, each, known, models) for name, each in given.items()}
    else:
        for name in given:
            require_instance(str, methods=name)
        makes = {name.partition("=")[0]: _named(name, known, models) for name in given}
        if len(makes) < len(set(given)):
            raise ParameterError("methods", f"expected a label of its own for each method, found {shown(given)}")
    found = {}
    for label, make in makes.items():
        method = built(label, make)  # refuses it now rather than after hours of other rows
        ours = make in known.values() and getattr(method, "reduced", False)
        found[f"{label} (reduced)" if ours else label] = make
    return found


def _factory(name: Any, given: Any, known: Mapping[str, Callable[[], Any]], models: bool) -> Callable[[], Any]:
    if isinstance(given, str):
        return _named(given, known, models)
    if not isinstance(given, type) and hasattr(given, "fit"):
        return partial(copy.deepcopy, given)
    if not callable(given):
        raise ParameterError("methods", f"expected a method with fit and predict for {name}, found {shown(given)}")
    return given


def _named(name: str, known: Mapping[str, Callable[[], Any]], models: bool) -> Callable[[], Any]:
    """The function that makes a method of a name, of a place, or of a folder of predictions."""
    if name in known:
        model = name if models and name in MODELS else None
        if model is not None and MODELS[model].needs:
            needed = ", ".join(MODELS[model].needs)
            expected = f"expected models that need no option, found {name}, which needs {needed}"
            raise ParameterError("methods", f"{expected}; bisplat train has it")
        return known[name]
    label, predicted, folder = name.partition("=")
    if predicted:
        if not label.strip() or not folder or label in known:
            expected = "expected LABEL=FOLDER with a label that no method here has"
            raise ParameterError("methods", f"{expected}, found {shown(name)}")
        return partial(Predictions, folder)
    if not name.partition(":")[2]:
        names = ", ".join(known)
        expected = f"expected one of {names}, module:Class or LABEL=FOLDER of predictions"
        raise ParameterError("methods", f"{expected}, found {shown(name)}")
    found = own_class(name, "methods")
    if models:
        from learn.methods.trained_model import TrainedModel
        from learn.models.base import SpectrumModel

        if isinstance(found, type) and issubclass(found, SpectrumModel):
            return partial(TrainedModel, name)
    return found


def check_effort(budget: float, seeds: int, steps: int | None = None) -> None:
    """Refuse a budget, a number of steps or a number of seeds that is out of its range."""
    if steps is not None:
        require_whole(1, STEPS_MOST, steps=steps)
    require_positive(budget=budget)
    require_within(0, MINUTES_MOST, "minutes", budget=budget)
    require_whole(1, SEEDS_MOST, seeds=seeds)


def checked_sizes(sizes: Any, things: str) -> list[int | None]:
    """Sizes of training parts, rising. None: the whole one."""
    if sizes is None:
        return [None]
    if isinstance(sizes, str) or not isinstance(sizes, Iterable):
        raise ParameterError("sizes", f"expected a list of numbers of training {things}, found {shown(sizes)}")
    found = list(sizes)
    for size in found:
        require_whole(1, MOST_POSITIONS, sizes=size)
    if not found or len(set(found)) < len(found):
        raise ParameterError("sizes", f"expected different numbers of training {things}, found {shown(found)}")
    return sorted(found)
