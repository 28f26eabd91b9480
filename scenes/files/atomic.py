"""Write files so that a reader always sees the old file or the complete new one, even after a crash.

They are written under names that nobody can foresee: where others can write, a link planted under a known name would
have the files behind it overwritten, and a file of the user's own would be lost.
"""

from __future__ import annotations

import fcntl
import os
import re
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from scenes.files.errors import InputError
from scenes.files.input_file import what_is_at


def write_atomically(path: Path, content: bytes | memoryview) -> None:
    """Write a file under a temporary name beside it, to the disk, then rename it into place."""
    with written_atomically(path) as temporary:
        temporary.write_bytes(content)


@contextmanager
def written_atomically(path: Path) -> Iterator[Path]:
    """Write a file atomically that is written piece by piece, or by another library."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with _named(path), temporary_file(path.parent) as temporary:
        yield temporary
        _sync(temporary)
        os.replace(temporary, path)


@contextmanager
def _named(path: Path) -> Iterator[None]:
    """Let an error name the file that was to be written, not the temporary one."""
    try:
        yield
    except OSError as error:
        parts = Path(os.fsdecode(error.filename or "")).parts
        if not parts or any(map(is_temporary, parts)):
            error.filename, error.filename2 = str(path), None
        raise


def require_writable(path: Path) -> None:
    """Find out before long work whether a file can be written. Remove what killed processes left in its folder."""
    with suppress(FileNotFoundError, NotADirectoryError):
        path.lstat()
    folder = next(each for each in path.parents if os.path.lexists(each))
    if not folder.is_dir():
        raise InputError(f"{folder}: expected a folder, found {what_is_at(folder)}")
    remove_left(folder)
    try:
        with temporary_file(folder):
            pass
    except OSError as error:
        error.filename = str(folder)
        raise


def sync_folder(folder: Path) -> None:
    """Wait until the file names in a folder are on the disk, so that a power cut does not undo changes to them."""
    try:
        _sync(folder)
    except OSError as error:
        error.filename = str(folder)
        raise


def _sync(path: Path) -> None:
    number = os.open(path, os.O_RDONLY)
    try:
        os.fsync(number)
    finally:
        os.close(number)


NAME = re.compile(r"\.bisplat-[0-9a-f]{16}\.(tmp|unfinished)")  # Names of temporary files and folders


def is_temporary(name: str) -> bool:
    return NAME.fullmatch(name) is not None


@contextmanager
def temporary_file(folder: Path) -> Iterator[Path]:
    """Make an empty file of a new name, and remove it at the end of the block if it is still there."""
    path = folder / _new_name("tmp")
    with _held(os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW, 0o666)):
        try:
            yield path
        finally:
            path.unlink(missing_ok=True)


@contextmanager
def temporary_folder(folder: Path) -> Iterator[Path]:
    """Make an empty folder of a new name, and remove it at the end of the block unless the block has renamed it."""
    path = folder / _new_name("unfinished")
    path.mkdir()
    try:
        with _held(os.open(path, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)):
            yield path
    finally:
        shutil.rmtree(path, ignore_errors=True)


def remove_left(folder: Path, deep: bool = False) -> None:
    """Remove temporary files and folders that no process holds, since those that made them were killed.

    Links are neither followed nor removed. On a disk that cannot lock files, nothing is removed.
    """
    for above, folders, files in os.walk(folder):
        for name in filter(is_temporary, (*folders, *files)):
            _remove_unless_held(Path(above, name))
        folders[:] = [name for name in folders if deep and not is_temporary(name)]


def _new_name(kind: str) -> str:
    return f".bisplat-{secrets.token_hex(8)}.{kind}"


@contextmanager
def _held(number: int) -> Iterator[None]:
    """Lock an open file or folder, so that others see that its process lives, and close it at the end."""
    try:
        with suppress(OSError):  # a disk that cannot lock
            fcntl.flock(number, fcntl.LOCK_EX | fcntl.LOCK_NB)
        yield
    finally:
        os.close(number)


def _remove_unless_held(path: Path) -> None:
    try:
        number = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)  # a pipe of that name would block
    except OSError:
        return
    try:
        fcntl.flock(number, fcntl.LOCK_EX | fcntl.LOCK_NB)
        if path.is_dir():
            shutil.rmtree(path)
        else:
            path.unlink()
    except OSError:  # a process holds it, the disk cannot lock files, or it is not ours to remove
        pass
    finally:
        os.close(number)
