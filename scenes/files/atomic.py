"""Write files so that a reader always sees the old file or the complete new one, even after a crash."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from scenes.files.errors import InputError
from scenes.files.input_file import what_is_at
from scenes.files.temporary import is_temporary, remove_left, temporary_file


def write_atomically(path: Path, content: bytes | memoryview) -> None:
    """Write a file under a temporary name beside it, to the disk, then rename it into place."""
    with written_atomically(path) as temporary:
        temporary.write_bytes(content)


@contextmanager
def written_atomically(path: Path) -> Iterator[Path]:
    """Write a file atomically that is written piece by piece, or by another library."""
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        with temporary_file(path.parent) as temporary:
            yield temporary
            _sync(temporary)
            os.replace(temporary, path)
    except OSError as error:
        if error.filename is None or is_temporary(Path(os.fsdecode(error.filename)).name):
            error.filename, error.filename2 = str(path), None
        raise


def require_writable(path: Path) -> None:
    """Find out before long work whether a file can be written. Remove what killed processes left in its folder.

    The folder, or the one above in which it will be made, gets a file, which is removed at once.
    """
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
