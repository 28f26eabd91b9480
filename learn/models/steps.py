"""Settings of training by gradient steps; each model has its own defaults. This module does not import torch."""

from __future__ import annotations

from dataclasses import dataclass, field

from scenes.files.errors import ParameterError, require_positive, require_whole, require_within, shown
from scenes.files.schema import LATER
from simulate.positions.given_positions import MOST_POSITIONS

STEPS_MOST = 10**9
"""Largest number of steps: many weeks of the fastest model."""


@dataclass(frozen=True, kw_only=True)
class Steps:
    """Settings of training by gradient steps.

    Attributes:
        steps: number of optimiser steps, rounded to whole validation periods.
        batch_size: number of spectra per step.
        learning_rate: learning rate of AdamW after the warm-up.
        weight_decay: weight decay of AdamW.
        full_resolution: share of the steps, at the end of the training, that use every pixel of a spectrum. The steps
            before use only as many pixels as the array can resolve. A model that learns from known responses uses no
            pixels.
        find_phases: if the dataset has only pictures, find the responses behind them for models that learn from
            responses.
        init: folder of a finished run of the same model, with whose weights training starts; None: random weights.

    Raises:
        ParameterError: a number is out of its range, or ``find_phases`` is neither true nor false.
    """

    steps: int = 1500
    batch_size: int = 8
    learning_rate: float = 1e-3
    weight_decay: float = 0.0
    full_resolution: float = 0.1
    find_phases: bool = field(default=True, metadata=LATER)
    init: str | None = None

    def __post_init__(self) -> None:
        require_whole(1, STEPS_MOST, steps=self.steps)
        require_whole(1, MOST_POSITIONS, batch_size=self.batch_size)
        require_positive(learning_rate=self.learning_rate)
        require_within(0, 1, "a learning rate", learning_rate=self.learning_rate)
        require_within(0, 1000, "a weight decay", weight_decay=self.weight_decay)
        require_within(0, 1, "a share", full_resolution=self.full_resolution)
        if not isinstance(self.find_phases, bool):
            raise ParameterError("find_phases", f"expected true or false, found {shown(self.find_phases)}")

    @property
    def coarse_steps(self) -> int:
        """Number of steps that use only a few pixels."""
        return round((1 - self.full_resolution) * self.steps)


@dataclass(frozen=True, kw_only=True)
class Processes:
    """Where a training runs.

    Attributes:
        devices: number of GPUs per machine; without a GPU, number of processes.
        nodes: number of machines; start the same command on each, for example with torchrun or SLURM.
    """

    devices: int = 1
    nodes: int = 1

    @property
    def count(self) -> int:
        """Number of devices on all machines together."""
        return self.devices * self.nodes
