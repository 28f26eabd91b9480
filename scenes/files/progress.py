"""Progress on stderr: bars in a terminal, and lines elsewhere, such as in a log file."""

from __future__ import annotations

from typing import Any

from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    Task,
    TaskID,
    TextColumn,
    TimeRemainingColumn,
)
from rich.text import Text

from scenes.files.long_work import AFTER, about, doing, tell
from scenes.files.plain_text import plain_console

UNLIMITED = 10_000  # Characters per line where there is no terminal, so that none is cut

LINES = 10  # Lines of a task where there is no terminal


class RateColumn(ProgressColumn):
    """Spectra per second."""

    def render(self, task: Task) -> Text:
        return Text(f"{task.speed:.1f}/s" if task.speed else "")


class ProgressLines(Progress):
    """Progress where there is no terminal: lines for the tenths of a task, or for what is said of one without end."""

    def __init__(self) -> None:
        super().__init__(disable=True, console=plain_console(stderr=True, width=UNLIMITED))
        self._said: dict[TaskID, int] = {}  # tenths

    def add_task(self, *given: Any, **options: Any) -> TaskID:
        task_id = super().add_task(*given, **options)
        doing(_sentence(self._tasks[task_id]))
        return task_id

    def update(self, task_id: TaskID, **changes: Any) -> None:
        super().update(task_id, **changes)
        self._say(task_id)

    def advance(self, task_id: TaskID, advance: float = 1) -> None:
        super().advance(task_id, advance)
        self._say(task_id)

    def _say(self, task_id: TaskID) -> None:
        task = self._tasks[task_id]
        sentence = _sentence(task)
        part = int(LINES * task.completed / task.total) if task.total else 0
        if part > self._said.get(task_id, 0):
            self._said[task_id] = part
            doing("")
            left = task.time_remaining if (task.elapsed or 0) > AFTER else None
            tell(f"{sentence}{about(left or 0, ' left')}", AFTER if part < LINES else 0.0)
        elif not task.total:
            doing(sentence)  # it is told later if it is not told now
            tell(sentence, AFTER)


def _sentence(task: Task) -> str:
    """What is being done, and how far it is."""
    whole = not task.total or task.total == task.completed == 1
    count = "" if whole else f": {task.completed:.0f} of {task.total:.0f}"
    return ", ".join(filter(None, [f"{task.description}{count}", task.fields.get("figures")]))


def progress_bar(*columns: ProgressColumn) -> Progress:
    """Return progress on stderr with a description, count and remaining time."""
    doing("")
    console = plain_console(stderr=True)
    if not (console.is_terminal or console.is_jupyter):
        return ProgressLines()
    description = TextColumn("{task.description}", markup=False)
    shown = columns or (RateColumn(),)
    return Progress(description, BarColumn(), MofNCompleteColumn(), *shown, TimeRemainingColumn(), console=console)
