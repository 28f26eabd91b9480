"""The options of a model: the keyword arguments of its class. This module does not import torch."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from typing import Any

from scenes.files.errors import ParameterError, require_flag, require_whole

OPTION_MOST = 1_000_000
"""Largest number that a model's option can be; more primitives or a wider network would exhaust the memory."""


def options_of(model: type) -> dict[str, Any]:
    """Options of a model's class with their defaults, including those that it passes on to its base class."""
    known: dict[str, Any] = {}
    for each in model.__mro__[:-1]:
        if "__init__" not in vars(each):
            continue
        parameters = inspect.signature(vars(each)["__init__"]).parameters.values()
        named = [parameter for parameter in parameters if parameter.kind is not inspect.Parameter.VAR_KEYWORD]
        known |= {parameter.name: parameter.default for parameter in named}
        if all(parameter.kind is not inspect.Parameter.VAR_KEYWORD for parameter in parameters):
            break  # this class passes no further options on to its base class
    for given_to_all in ("self", "region", "beamformer", "wavelength"):
        known.pop(given_to_all, None)
    return known


def check_options_of(model: type, name: str, options: Mapping[str, Any]) -> None:
    """Check that a model's class takes these options."""
    known = options_of(model)
    for option, value in options.items():
        if option not in known:
            has = f"which has {', '.join(known)}" if known else "which has none"
            raise ParameterError(option, f"expected an option of the model {name}, {has}; found {option}")
        if isinstance(known[option], bool):
            require_flag(**{option: value})
        elif isinstance(known[option], int):
            require_whole(1, OPTION_MOST, **{option: value})
