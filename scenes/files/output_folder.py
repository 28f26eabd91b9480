"""Output folders: a new one that appears when it is whole, or one's own, which the same command continues."""

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
    """Make a folder. If the process is killed on the way, the same call begins anew.

    Args:
        output: the folder: a new or an empty one.
        force: it may hold other files, of which those of the same names are replaced; None: the command has no
            --force.

    Yields:
        The folder to write to, in .NAME.unfinished beside the output.

    Raises:
        InputError: the output holds other files, or another process makes it.
    """
    output = output.absolute()
    _require_new(output, force)
    unfinished = output.with_name(f".{output.name}.unfinished")
    with locked(unfinished):
        new = unfinished / "new"
        shutil.rmtree(new, ignore_errors=True)  # of a process that was killed
        try:
            new.mkdir()
            yield new
            _require_new(output, force)
            if not output.exists():
                new.rename(output)
                return
            # Files of subfolders first: a scene's YAML and a dataset's index files, which refer to these, come last.
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
        hint = "" if force is None else "; --force replaces those of the same names"
        raise InputError(f"{output}: expected a new folder, found other files{hint}")


@contextmanager
def own_folder(
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
    with locked(folder):
        require_own(folder, kind, record, settings, read)  # another process may have begun in the meantime
        yield


def require_own(
    folder: Path, kind: str, record: str, settings: dict[str, Any], read: Callable[[Path], dict[str, Any]]
) -> None:
    """Check that a folder is new, or holds something with the same settings; ``own_folder`` explains the arguments.

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
