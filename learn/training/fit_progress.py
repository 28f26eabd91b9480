"""Progress of a fit on stderr (a bar for each phase in a terminal, or a line), and a loop of steps or minutes."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from types import TracebackType

import torch
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn, TimeElapsedColumn
from torch import Tensor


class FitProgress:
    """Shows what a fit is doing; a ``learn.models.base.Report`` while it is entered."""

    def __init__(self, title: str) -> None:
        self._title = title
        self._console = Console(stderr=True)
        self._progress = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            console=self._console,
            disable=not self._console.is_terminal,
        )
        self._phase: str | None = None
        self._bar: TaskID | None = None

    def __enter__(self) -> FitProgress:
        if self._console.is_terminal:
            self._say(self._title)
        self._progress.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None):
        if kind is None:
            self._finish()
        self._progress.stop()

    def __call__(self, phase: str, done: int, total: int) -> None:
        """Show that ``done`` of at most ``total`` steps of a phase are done. A new phase ends the one before it."""
        if phase != self._phase:
            self._finish()
            self._phase = phase
            self._bar = self._progress.add_task(phase, total=total)
            if not self._console.is_terminal:
                self._say(f"{self._title}: {phase}")
        if self._bar is not None:
            self._progress.update(self._bar, completed=done, total=total)

    def _finish(self) -> None:
        """Fill the bar of the phase, which may have needed fewer steps than the largest number."""
        if self._bar is not None:
            self._progress.update(self._bar, completed=self._progress.tasks[-1].total)

    def _say(self, text: str) -> None:
        self._console.print(f"bisplat: {text}", highlight=False, soft_wrap=True)


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
