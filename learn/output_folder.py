"""Check of an output folder: it is new, or the same command wrote to it before and now continues."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from scenes.errors import InputError


def claim(folder: Path, kind: str, settings: dict[str, Any], begun: dict[str, Any] | None) -> None:
    """Make an output folder, or check that the run or experiment in it has the same settings.

    Args:
        folder: folder that a run or an experiment will be written to.
        kind: "run" or "experiment".
        settings: its settings, by name.
        begun: settings of the run or experiment that is in the folder already; None: the folder has none.

    Raises:
        InputError: the folder holds other files, or a run or experiment with other settings.
    """
    if begun is None:
        if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
            raise InputError(f"{folder}: expected a new folder or an earlier {kind}, found other files")
        begun = settings
    for name in {**settings, **begun}:
        if begun.get(name) != settings.get(name):
            raise InputError(
                f"{folder}: expected a new folder or an earlier {kind} with {name} {settings.get(name)}, found one "
                f"with {name} {begun.get(name)}"
            )
    folder.mkdir(parents=True, exist_ok=True)
