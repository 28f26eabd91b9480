"""A folder that a command goes on in: made anew, or one that the very same command began."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from scenes.errors import InputError


def claim(folder: Path, kind: str, settings: dict[str, Any], begun: dict[str, Any] | None) -> None:
    """Make the folder, or make sure that what was begun in it has these settings.

    Args:
        folder: where a run or an experiment is to be written.
        kind: "run" or "experiment".
        settings: what it is begun with.
        begun: what the one found in the folder was begun with; None: there is none.

    Raises:
        InputError: the folder holds something else, or one of other settings.
    """
    if begun is None and folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise InputError(f"{folder}: expected a new folder or an earlier {kind}, found other files")
    for name, value in settings.items():
        if begun is not None and begun.get(name) != value:
            raise InputError(
                f"{folder}: expected a new folder or this {kind} begun before, found one whose {name} is "
                f"{begun.get(name)}, not {value}"
            )
    folder.mkdir(parents=True, exist_ok=True)
