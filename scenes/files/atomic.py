"""Write files so that a reader always sees the old file or the complete new one, even after a crash."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


def write_atomically(path: Path, content: bytes | memoryview) -> None:
    """Write a file under a temporary name beside it, to the disk, then rename it into place.

    Args:
        path: the file. Its folder is created if it does not exist.
        content: all of its bytes.

    Raises:
        OSError: the file cannot be written. It is then as it was before, and the temporary file is removed. The error
            has a file name even if the operating system gives none, as for a full disk.
    """
    with written_atomically(path) as temporary:
        temporary.write_bytes(content)


@contextmanager
def written_atomically(path: Path) -> Iterator[Path]:
    """Write a file atomically that is written piece by piece, or by another library.

    Args:
        path: the file. Its folder is created if it does not exist.

    Yields:
        The temporary path, to which the block writes the whole file. If the block raises an error, the file stays as
        it was before.

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
    """Wait until the file names in a folder are on the disk, so that a power cut does not undo changes to them.

    Args:
        folder: the folder.

    Raises:
        OSError: the folder cannot be opened or written. The error has the name of the folder.
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
