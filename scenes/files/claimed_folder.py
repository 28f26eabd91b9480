"""A folder that one program or tab at a time writes to, and in which nothing is replaced that nobody allowed."""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import os
from collections.abc import Iterator, Mapping
from pathlib import Path

from scenes.files.errors import InputError
from scenes.files.input_file import require_regular


class FilesInTheWay(InputError):
    """Files that would have been replaced, though nobody allowed it.

    Attributes:
        digests: SHA-256 of each, by its path.
    """

    def __init__(self, digests: Mapping[Path, str]):
        self.digests = digests
        others = f" and {len(digests) - 1} more exist" if len(digests) > 1 else " exists"
        super().__init__(f"{next(iter(digests))}{others} already and is never overwritten; give another folder")


@contextlib.contextmanager
def claimed(folder: Path) -> Iterator[None]:
    """Keep a folder for oneself within a block. The claim ends with the process, however that ends.

    Args:
        folder: made where it is missing.

    Raises:
        InputError: it is no folder, or it is claimed already.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError):
        raise InputError(f"{folder}: expected a folder or nothing, found a file on the way to it") from None
    number = os.open(folder, os.O_RDONLY)
    try:
        try:
            fcntl.flock(number, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise InputError(f"{folder}: another program or tab is writing to it; try again when it is done") from None
        yield
    finally:
        os.close(number)


def digest(content: bytes) -> str:
    """SHA-256 of bytes."""
    return hashlib.sha256(content).hexdigest()


def digest_of_file(path: Path) -> str | None:
    """SHA-256 of a file's content, which need not fit into memory; None: there is nothing of that name.

    Raises:
        InputError: it is no regular file, or a link to none.
    """
    if not os.path.lexists(path):
        return None
    require_regular(path, "a file or nothing", 2**63)
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
