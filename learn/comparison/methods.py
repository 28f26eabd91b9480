"""The methods of a comparison by name: baselines, models of the registry, and the user's own classes."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import torch

from learn.comparison.baseline_methods import BASELINES
from learn.comparison.own_method import is_own, plain_settings, source_hash
from learn.comparison.task import Method
from learn.comparison.trained_model import TrainedModel
from learn.models.base import SpectrumModel
from learn.training.own_class import own_class
from learn.training.registry import MODELS
from scenes.files.errors import ParameterError, shown


def method_names() -> list[str]:
    """Names of all baselines and of the models that need no options.

    >>> "nearest" in method_names() and "helmholtz" in method_names()
    True
    """
    return [*BASELINES, *(name for name, entry in MODELS.items() if not entry.needs)]


def is_reduced(name: str) -> bool:
    """Whether a model is compared at a reduced size because there is no GPU.

    Args:
        name: name of a method.
    """
    return (
        isinstance(name, str)
        and name in MODELS
        and bool(MODELS[name].options_without_gpu)
        and not torch.cuda.is_available()
    )


def method_named(name: str) -> Callable[[], Method]:
    """The function that makes a new, unfitted method.

    Args:
        name: name of a baseline or a model, or the user's own class as ``module:Class``.

    Raises:
        ParameterError: the method is unknown, or its module cannot be imported. The message says why.
    """
    if not isinstance(name, str):
        raise ParameterError("models", f"expected names of methods, found {shown(name)}")
    if name in BASELINES:
        return BASELINES[name]
    if name in MODELS:
        options = dict(MODELS[name].options_without_gpu) if is_reduced(name) else {}
        return partial(TrainedModel, name, options=options)
    if not name.partition(":")[2]:
        known = ", ".join(method_names())
        raise ParameterError("models", f"expected one of {known}, or module:Class, found {shown(name)}")
    found = own_class(name, "models")
    if isinstance(found, type) and issubclass(found, SpectrumModel):
        return partial(TrainedModel, name)
    return found


def source_of(label: str, method: Any) -> str | None:
    """A hash of what a method is, which tells when a row has to be measured again.

    Args:
        label: label of its rows.
        method: an unfitted method.

    Returns:
        16 digits. None: the label says what the method is; or it is the user's, and its source is not known.

    >>> source_of("nearest", BASELINES["nearest"]()) is None, len(source_of("ours", BASELINES["nearest"]()))
    (True, 16)
    """
    if is_own(method):
        return source_hash(method)
    try:
        usual = method_named(label.removesuffix(" (reduced)"))()
    except ParameterError:
        usual = None
    found = _in_words(method)
    return None if usual is not None and _in_words(usual) == found else hashlib.sha256(found.encode()).hexdigest()[:16]


def _in_words(method: Method) -> str:
    """The class of one of our methods, its settings, and the weights that its training starts from."""
    settings = plain_settings(method)
    init = settings.pop("init", None)
    weights = "" if init is None else hashlib.sha256((Path(init) / "weights.safetensors").read_bytes()).hexdigest()
    return f"{type(method).__name__} {sorted(settings.items())!r} {weights}"
