"""Write files so that a reader, also after a run was killed, sees either the old file or the whole new one."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


def write_atomically(path: Path, content: bytes | memoryview) -> None:
    """Write a file under a temporary name beside it, to the disk, then rename it into place.

    Args:
        path: the file; its folder is made where it is missing.
        content: all of its bytes.

    Raises:
        OSError: the file cannot be written; it is then as it was before, the temporary one is removed, and the error
            has a file name also where the operating system gives none (a full disk).
    """
    with written_atomically(path) as temporary:
        temporary.write_bytes(content)


@contextmanager
def written_atomically(path: Path) -> Iterator[Path]:
    """The same for a file that is written piece by piece, or by another library.

    Args:
        path: the file; its folder is made where it is missing.

    Yields:
        The temporary name, which the block writes the whole file to. If the block raises any error, the file is as it
        was before.

    Raises:
        OSError: the temporary file cannot be written to the disk or renamed.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(path.name + ".tmp")
    try:
        yield temporary
        _sync(temporary)
        os.replace(temporary, path)
    except BaseException as error:
        temporary.unlink(missing_ok=True)
        if isinstance(error, OSError) and error.filename is None:
            error.filename = str(path)
        raise


def sync_folder(folder: Path) -> None:
    """Wait until the names in a folder are on the disk, so that after a power cut it has no older ones.

    Args:
        folder: the folder.

    Raises:
        OSError: the folder cannot be opened or written; the error has its name.
    """
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
