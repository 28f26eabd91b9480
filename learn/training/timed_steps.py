"""Training for steps or for minutes, of models that are fitted anew for each comparison and store nothing."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

import torch
from torch import Tensor

from learn.training.fit_progress import FitProgress


def train_steps(
    loss: Callable[[], Tensor], optimiser: torch.optim.Optimizer, *, title: str, most: int, minutes: float | None
) -> int:
    """Train, with a learning rate that falls as half a cosine, until the steps or the minutes are over."""
    rates = [group["lr"] for group in optimiser.param_groups]
    begun = time.perf_counter()
    with FitProgress(title) as report:
        for step in range(most):
            done = step / most
            if minutes is not None and step:
                done = max(done, (time.perf_counter() - begun) / (60 * minutes))
            if done >= 1:
                return step
            report("training", int(100 * done), 100)
            for group, rate in zip(optimiser.param_groups, rates, strict=True):
                group["lr"] = rate * (1 + math.cos(math.pi * done)) / 2
            optimiser.zero_grad()
            loss().backward()
            optimiser.step()
    return most
