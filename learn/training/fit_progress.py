"""Progress of a fit on stderr (a bar for each phase in a terminal, or a line), and a loop of steps or minutes."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from types import TracebackType

import torch
from rich.progress import TaskID, TimeElapsedColumn
from torch import Tensor

from scenes.files.progress import progress_bar


class FitProgress:
    """Shows what a fit is doing; a ``learn.models.base.Report`` while it is entered."""

    def __init__(self, title: str) -> None:
        self._title, self._progress = title, progress_bar(TimeElapsedColumn())
        self._phase: str | None = None
        self._task: TaskID | None = None

    def __enter__(self) -> FitProgress:
        self._progress.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None):
        if kind is None:
            self._finish()
        self._progress.stop()

    def __call__(self, phase: str, done: int, total: int) -> None:
        """Show that ``done`` of at most ``total`` steps of a phase are done. A new phase ends the one before it."""
        if self._task is None or phase != self._phase:
            self._finish()
            self._phase, self._task = phase, self._progress.add_task(f"{self._title}: {phase}", total=total)
        self._progress.update(self._task, completed=done, total=total)

    def _finish(self) -> None:
        """Fill the bar of the phase, which may have needed fewer steps than the largest number."""
        if self._task is not None and not self._progress.disable:  # a line would tell steps that were not needed
            self._progress.update(self._task, completed=self._progress.tasks[-1].total)


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
