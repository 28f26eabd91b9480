"""Settings of training by gradient steps, of which each model has its own defaults. This module needs no torch."""

from __future__ import annotations

import math
from dataclasses import dataclass

from scenes.errors import ParameterError, require_positive


@dataclass(frozen=True, kw_only=True)
class Steps:
    """Settings of training by gradient steps.

    Attributes:
        steps: number of optimiser steps, rounded to whole validation periods.
        batch_size: number of spectra per step.
        learning_rate: learning rate of AdamW after the warm-up.
        weight_decay: weight decay of AdamW.
        full_resolution: share of the steps, the last ones, that look at every pixel of a spectrum; those before look at
            a few that hold the array's band (learn/models/quadrature.py). A model that learns from known responses
            looks at no pixels.
        init: folder of a finished run of the same model whose weights training starts from; None: random weights.
    """

    steps: int = 1500
    batch_size: int = 8
    learning_rate: float = 1e-3
    weight_decay: float = 0.0
    full_resolution: float = 0.1
    init: str | None = None

    def __post_init__(self) -> None:
        require_positive(steps=self.steps, batch_size=self.batch_size, learning_rate=self.learning_rate)
        if not (math.isfinite(self.weight_decay) and self.weight_decay >= 0):
            raise ParameterError("weight_decay", f"expected a number of at least 0, found {self.weight_decay}")
        if not 0 <= self.full_resolution <= 1:
            raise ParameterError("full_resolution", f"expected a share of 0 to 1, found {self.full_resolution}")

    @property
    def coarse_steps(self) -> int:
        """Number of steps that look at a few pixels only."""
        return round((1 - self.full_resolution) * self.steps)
