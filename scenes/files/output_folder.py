"""Output folders: a new one that appears only when it is complete, or one that the same command continues."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from scenes.files.errors import InputError, shown
from scenes.files.folder_lock import LOCK, locked
from scenes.files.input_file import what_is_at
from scenes.files.temporary import is_temporary, remove_left, temporary_folder


@contextmanager
def new_folder(output: Path, force: bool | None = None) -> Iterator[Path]:
    """Make a folder. If the process is killed before the end, the same call starts again from the beginning."""
    _require_new(output, force)
    made = not output.exists()
    try:
        with locked(output):
            _require_new(output, force)
            remove_left(output)
            with temporary_folder(output) as new:
                yield new
                _require_new(output, force)
                move_content(new, output)
    except BaseException:
        if made:
            with suppress(OSError):  # another process has begun to use it
                output.rmdir()
        raise


def _require_new(output: Path, force: bool | None) -> None:
    if os.path.lexists(output) and not output.is_dir():
        raise InputError(f"{output}: expected a new folder, found {what_is_at(output)}")
    if output.exists() and not force and has_other_files(output):
        hint = "" if force is None else "; --force replaces files of the same names"
        raise InputError(f"{output}: expected a new folder, found other files{hint}")


def has_other_files(folder: Path) -> bool:
    """Whether a folder has other files than those that a process leaves that was killed before it wrote any."""
    return any(path.name != LOCK and not is_temporary(path.name) for path in folder.iterdir())


def move_content(source: Path, target: Path) -> None:
    """Move folders, then files, to a folder on the same disk. A link in the way is replaced, not followed."""
    for path in sorted(source.iterdir(), key=lambda path: (path.is_file(), path.name)):
        place = target / path.name
        if path.is_dir() and place.is_dir() and not place.is_symlink():
            move_content(path, place)
            continue
        if path.is_dir():
            place.unlink(missing_ok=True)
        elif place.is_dir() and not place.is_symlink():
            raise InputError(f"{place}: expected a file to replace, found a folder")
        os.replace(path, place)


@contextmanager
def own_folder(
    folder: Path, kind: str, record: str, settings: dict[str, Any], read: Callable[[Path], dict[str, Any]]
) -> Iterator[None]:
    """Make an output folder, or check that an existing one has the same settings. Lock it within a block."""
    require_own(folder, kind, record, settings, read)
    with locked(folder):
        require_own(folder, kind, record, settings, read)  # another process may have started in the meantime
        remove_left(folder, deep=True)
        yield


def require_own(
    folder: Path, kind: str, record: str, settings: dict[str, Any], read: Callable[[Path], dict[str, Any]]
) -> None:
    """Check that a folder is new, or has the same settings. ``own_folder`` explains the arguments."""
    if not os.path.lexists(folder / record):
        if folder.exists() and (not folder.is_dir() or has_other_files(folder)):
            raise InputError(f"{folder}: expected a new folder or an earlier {kind}, found other files")
        return
    found = read(folder / record)
    for name in {**settings, **found}:
        if found.get(name) != settings.get(name):
            raise InputError(
                f"{folder}: expected a new folder or an earlier {kind} with {name} {shown(settings.get(name))}, found "
                f"one with {name} {shown(found.get(name))}"
            )
