"""An output folder: a new one, or one that the same command began and now continues."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from scenes.errors import InputError


def claim(folder: Path, kind: str, settings: dict[str, Any], begun: dict[str, Any] | None) -> None:
    """Make the folder, or make sure that what was begun in it has these settings.

    Args:
        folder: where a run or an experiment is to be written.
        kind: "run" or "experiment".
        settings: its settings, by name.
        begun: settings of the run or experiment found in the folder; None: there is none.

    Raises:
        InputError: the folder holds something else, or one of other settings.
    """
    if begun is None:
        if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
            raise InputError(f"{folder}: expected a new folder or an earlier {kind}, found other files")
        begun = settings
    for name in {**settings, **begun}:
        if begun.get(name) != settings.get(name):
            raise InputError(
                f"{folder}: expected a new folder or this {kind} begun before, found one whose {name} is "
                f"{begun.get(name)}, not {settings.get(name)}"
            )
    folder.mkdir(parents=True, exist_ok=True)
