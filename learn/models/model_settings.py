"""Settings of training by gradient steps, and the options of a model. This module does not import torch."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from scenes.files.errors import ParameterError, require_flag, require_positive, require_whole, require_within
from scenes.files.options import check_kinds
from simulate.positions.positions import MOST_POSITIONS

PATIENCE = 5  # validations without a better one after which a training stops whose steps nobody asked for
STEPS_MOST = 10**9  # largest number of steps: many weeks of the fastest model
MINUTES_MOST = 10_000.0  # largest training time: a week
MatmulPrecision = Literal["highest", "high", "medium"]  # precisions of ``torch.set_float32_matmul_precision``


@dataclass(frozen=True, kw_only=True)
class Steps:
    """Settings of training by gradient steps.

    Attributes:
        steps: number of optimiser steps.
        batch_size: number of spectra per step.
        learning_rate: learning rate of AdamW after the warm-up.
        weight_decay: weight decay of AdamW.
        full_resolution: share of the steps that use every pixel: the last ones. The steps before use a few pixels.
            Models that learn from responses use no pixels.
        matmul_precision: how exact the matrix products of a training step are, in PyTorch's words. highest: single
            precision; high: TF32; medium: bfloat16. On hardware without a faster one, the next higher one is used.
        find_phases: find the responses behind the pictures, for models that learn from responses.
        init: finished run of the same model whose weights training starts from. None: random weights.
        patience: number of validations without a better one after which training stops; 0: never. ``train`` takes 5 if
            neither steps nor a budget nor a preset is given, and otherwise all steps.

    Raises:
        ParameterError: a number is out of its range, or ``find_phases`` is neither true nor false.
    """

    steps: int = 1500
    batch_size: int = 8
    learning_rate: float = 1e-3
    weight_decay: float = 0.0
    full_resolution: float = 0.1
    matmul_precision: MatmulPrecision = "highest"
    find_phases: bool = True
    init: str | None = None
    patience: int = 0

    def __post_init__(self) -> None:
        check_kinds(self)
        require_whole(1, STEPS_MOST, steps=self.steps)
        require_whole(1, MOST_POSITIONS, batch_size=self.batch_size)
        require_whole(0, STEPS_MOST, patience=self.patience)
        require_positive(learning_rate=self.learning_rate)
        require_within(0, 1, "a learning rate", learning_rate=self.learning_rate)
        require_within(0, 1000, "a weight decay", weight_decay=self.weight_decay)
        require_within(0, 1, "a share", full_resolution=self.full_resolution)

    @property
    def coarse_steps(self) -> int:
        """Number of steps that use only a few pixels."""
        return round((1 - self.full_resolution) * self.steps)


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
