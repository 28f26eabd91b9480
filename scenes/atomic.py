"""Write files so that a reader, also after a run was killed, sees either the old file or the whole new one."""

from __future__ import annotations

import os
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
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(path.name + ".tmp")
    try:
        with temporary.open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        if error.filename is None:
            error.filename = str(path)
        raise


def sync_folder(folder: Path) -> None:
    """Wait until the names in a folder are on the disk, so that after a power cut it has no older ones.

    Args:
        folder: the folder.

    Raises:
        OSError: the folder cannot be opened or written; the error has its name.
    """
    number = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(number)
    except OSError as error:
        error.filename = str(folder)
        raise
    finally:
        os.close(number)
