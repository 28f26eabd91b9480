"""The methods of a comparison by name: baselines, models of the registry, and the user's own classes."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import torch

from learn.comparison.baseline_methods import BASELINES
from learn.comparison.task import Method
from learn.comparison.trained_model import TrainedModel
from learn.models.base import SpectrumModel
from learn.training.registry import MODELS, own_class
from scenes.files.errors import ParameterError, shown


def method_names() -> list[str]:
    """Names of all baselines and of the models that need no options.

    >>> "nearest" in method_names() and "helmholtz" in method_names()
    True
    """
    return [*BASELINES, *(name for name, entry in MODELS.items() if not entry.needs)]


def is_reduced(name: str) -> bool:
    """Whether a model is compared at a reduced size because there is no GPU."""
    return (
        isinstance(name, str)
        and name in MODELS
        and bool(MODELS[name].options_without_gpu)
        and not torch.cuda.is_available()
    )


def method_named(name: str) -> Callable[[], Method]:
    """The function that makes a new, unfitted method."""
    if not isinstance(name, str):
        raise ParameterError("models", f"expected names of methods, found {shown(name)}")
    if name in BASELINES:
        return BASELINES[name]
    if name in MODELS:
        if MODELS[name].needs:
            needed = ", ".join(MODELS[name].needs)
            raise ParameterError(
                "models",
                f"expected models that need no option, found {name}, which needs {needed}; bisplat train has it",
            )
        return _trained(name)
    if not name.partition(":")[2]:
        known = ", ".join(method_names())
        raise ParameterError("models", f"expected one of {known}, or module:Class, found {shown(name)}")
    found = own_class(name, "models")
    if isinstance(found, type) and issubclass(found, SpectrumModel):
        return partial(TrainedModel, name)
    return found


def usual_methods() -> dict[str, Callable[[], Method]]:
    """The functions that make our methods, by name, also of the models that need options."""
    return {**BASELINES, **{name: _trained(name) for name in MODELS}}


def _trained(name: str) -> Callable[[], Method]:
    return partial(TrainedModel, name, options=dict(MODELS[name].options_without_gpu) if is_reduced(name) else {})
