"""An output folder of one run or experiment: new, or the same command wrote to it before and now continues."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from scenes.files.errors import InputError, shown
from scenes.files.folder_lock import LOCK, locked


@contextmanager
def claimed(
    folder: Path, kind: str, record: str, settings: dict[str, Any], read: Callable[[Path], dict[str, Any]]
) -> Iterator[None]:
    """Make an output folder, or check that what is in it has the same settings; then keep other processes from it.

    Args:
        folder: folder that a run, an experiment or a demo will be written to.
        kind: what it will be, for messages: "run", "experiment" or "demo".
        record: name of the file that records its settings, which is written first.
        settings: its settings, by name.
        read: function from the path of such a file to the settings in it.

    Raises:
        InputError: the folder holds other files, something with other settings, or another process writes to it.
    """
    require_own(folder, kind, record, settings, read)
    folder.mkdir(parents=True, exist_ok=True)
    with locked(folder):
        require_own(folder, kind, record, settings, read)  # another process may have begun in the meantime
        yield


def require_own(
    folder: Path, kind: str, record: str, settings: dict[str, Any], read: Callable[[Path], dict[str, Any]]
) -> None:
    """Check that a folder is new, or holds something with the same settings; arguments as those of ``claimed``.

    Raises:
        InputError: the folder holds other files, or something with other settings.
    """
    if not os.path.lexists(folder / record):
        left = {LOCK, f"{record}.tmp"}  # by a process that was killed in its first moment
        if folder.exists() and (not folder.is_dir() or {path.name for path in folder.iterdir()} - left):
            raise InputError(f"{folder}: expected a new folder or an earlier {kind}, found other files")
        return
    found = read(folder / record)
    for name in {**settings, **found}:
        if found.get(name) != settings.get(name):
            raise InputError(
                f"{folder}: expected a new folder or an earlier {kind} with {name} {shown(settings.get(name))}, found "
                f"one with {name} {shown(found.get(name))}"
            )
