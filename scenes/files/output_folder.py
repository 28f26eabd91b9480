"""Output folders: a new one that appears only when it is complete, or one that the same command continues."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from scenes.files.errors import InputError, shown
from scenes.files.folder_lock import LOCK, locked


@contextmanager
def new_folder(output: Path, force: bool | None = None) -> Iterator[Path]:
    """Make a folder. If the process is killed before the end, the same call starts again from the beginning.

    Args:
        output: the folder, which must be new or empty.
        force: whether the folder may contain other files, of which those of the same names are replaced. None: the
            command has no option --force.

    Yields:
        The folder to write to, in .NAME.unfinished beside the output.

    Raises:
        InputError: the output contains other files, or another process is making it.
    """
    output = output.absolute()
    _require_new(output, force)
    unfinished = output.with_name(f".{output.name}.unfinished")
    with locked(unfinished):
        new = unfinished / "new"
        shutil.rmtree(new, ignore_errors=True)  # left by a process that was killed
        try:
            new.mkdir()
            yield new
            _require_new(output, force)
            if not output.exists():
                new.rename(output)
                return
            # Files of subfolders first: a scene's YAML and a dataset's index files refer to them and come last.
            files = [path for path in new.rglob("*") if path.is_file()]
            for file in sorted(files, key=lambda path: -len(path.parts)):
                place = output / file.relative_to(new)
                place.parent.mkdir(parents=True, exist_ok=True)
                os.replace(file, place)
        finally:
            shutil.rmtree(unfinished, ignore_errors=True)


def _require_new(output: Path, force: bool | None) -> None:
    if output.exists() and not output.is_dir():
        raise InputError(f"{output}: expected a new folder, found a file")
    if output.exists() and not force and any(output.iterdir()):
        hint = "" if force is None else "; --force replaces files of the same names"
        raise InputError(f"{output}: expected a new folder, found other files{hint}")


@contextmanager
def own_folder(
    folder: Path, kind: str, record: str, settings: dict[str, Any], read: Callable[[Path], dict[str, Any]]
) -> Iterator[None]:
    """Make an output folder, or check that an existing one has the same settings. Lock it within a block.

    Args:
        folder: folder of a run, an experiment or a demo.
        kind: what the folder contains, for messages: "run", "experiment" or "demo".
        record: name of the file that records the settings. It is written first.
        settings: the settings, by name.
        read: function that reads the settings from such a file.

    Raises:
        InputError: the folder contains other files or other settings, or another process is writing to it.
    """
    require_own(folder, kind, record, settings, read)
    with locked(folder):
        require_own(folder, kind, record, settings, read)  # another process may have started in the meantime
        yield


def require_own(
    folder: Path, kind: str, record: str, settings: dict[str, Any], read: Callable[[Path], dict[str, Any]]
) -> None:
    """Check that a folder is new, or has the same settings. ``own_folder`` explains the arguments.

    Raises:
        InputError: the folder contains other files or other settings.
    """
    if not os.path.lexists(folder / record):
        left = {LOCK, f"{record}.tmp"}  # left by a process that was killed at its start
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
