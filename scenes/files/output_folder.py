"""Output folders: a new one that appears only when complete, or one that the same command continues.

One process at a time writes to a folder. A second one is told at once which process that is.
"""

from __future__ import annotations

import datetime
import errno
import fcntl
import os
import socket
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from scenes.files.atomic import is_temporary, remove_left, temporary_folder
from scenes.files.errors import InputError, printable, shown
from scenes.files.input_file import what_is_at
from scenes.files.plain_text import say


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


LOCK = ".bisplat-lock"
"""The file that a process locks while it writes to a folder. A killed process leaves the file behind, unlocked."""

NO_LOCKS = (errno.ENOSYS, errno.EOPNOTSUPP, errno.ENOTSUP, errno.ENOLCK)
"""Errors of network disks that cannot lock files."""

LONGEST = 1000  # Most bytes of another process's lock file that are read


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Lock an output folder within a block. If the disk cannot lock files, print a warning instead."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError):
        raise InputError(f"{folder}: expected a folder or a path to a new one, found a file on the path") from None
    inside = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        number = _lock(folder, inside)
        try:
            yield
        finally:
            # Removed while it is locked: a later file of this name belongs to another process.
            if _is_there(number, inside):
                os.unlink(LOCK, dir_fd=inside)
            os.close(number)
    finally:
        os.close(inside)


def _lock(folder: Path, inside: int) -> int:
    """Open and lock the lock file, and return its file descriptor.

    This uses flock, not the package filelock: filelock empties the file when a second process tries to lock it, and the
    second process could not say which process has the lock. The system ends the lock when the process ends.
    """
    while True:
        try:
            number = os.open(LOCK, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o666, dir_fd=inside)
        except OSError as error:
            error.filename = str(folder / LOCK)
            raise
        try:
            fcntl.flock(number, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if _is_there(number, inside):
                os.ftruncate(number, 0)
                os.write(number, _this_process().encode())
                return number
        except BlockingIOError:
            holder = printable(os.pread(number, LONGEST, 0).decode(errors="replace")) or "another process"
            os.close(number)
            raise InputError(
                f"{folder}: expected a folder that no other process writes to, found that {holder} is writing to it"
            ) from None
        except OSError as error:
            if error.errno in NO_LOCKS:
                say(
                    f"warning: {folder}: this disk cannot lock files ({error.strerror}); make sure that no other "
                    "process writes to this folder at the same time"
                )
                return number
            os.close(number)
            error.filename = str(folder / LOCK)
            raise
        os.close(number)  # another process removed the file after we opened it


def _is_there(number: int, inside: int) -> bool:
    """Whether an open lock file is still the one in the folder."""
    try:
        return os.path.samestat(os.fstat(number), os.stat(LOCK, dir_fd=inside, follow_symlinks=False))
    except FileNotFoundError:
        return False


def _this_process() -> str:
    now = datetime.datetime.now().isoformat(sep=" ", timespec="seconds")
    return f"process {os.getpid()} of {socket.gethostname()} ({shown(' '.join(sys.argv))}, since {now})"
