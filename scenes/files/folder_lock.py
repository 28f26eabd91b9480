"""One process at a time writes to an output folder; a second one is told at once which process that is."""

from __future__ import annotations

import datetime
import errno
import fcntl
import os
import socket
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from scenes.files.errors import InputError, printable, shown
from scenes.files.plain_text import say

LOCK = ".bisplat-lock"
"""The file in a folder that is locked while a process writes there. A killed process leaves the file, but unlocked."""

NO_LOCKS = (errno.ENOSYS, errno.EOPNOTSUPP, errno.ENOTSUP, errno.ENOLCK)
"""What network disks answer that cannot lock files."""

LONGEST = 1000
"""Bytes that are read of what another process says of itself."""


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Keep an output folder for oneself within a block; where the disk cannot lock files, warn that nothing does.

    Args:
        folder: made where it is missing; it may be renamed in the meantime.

    Raises:
        InputError: it is no folder, or another process, or another part of this one, holds it.
        OSError: the folder cannot be written to.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError):
        raise InputError(f"{folder}: expected a folder or nothing, found a file on the way to it") from None
    inside = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        number = _lock(folder, inside)
        try:
            yield
        finally:
            # Removed while it is held: a file of this name that comes later is another process's.
            if _is_there(number, inside):
                os.unlink(LOCK, dir_fd=inside)
            os.close(number)
    finally:
        os.close(inside)


def _lock(folder: Path, inside: int) -> int:
    """The number of the lock file, opened and locked.

    By flock itself and not by the package filelock, which empties the file when a second process looks, so that it
    could not say who holds it. The system ends the lock with the process, however that ends.
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
                f"{folder}: expected a folder that no other process writes to, found one that {holder} writes to"
            ) from None
        except OSError as error:
            if error.errno in NO_LOCKS:
                say(
                    f"warning: {folder}: this disk cannot lock files ({error.strerror}); let no second process write "
                    "to this folder at the same time"
                )
                return number
            os.close(number)
            error.filename = str(folder / LOCK)
            raise
        os.close(number)  # its process removed it between our opening and locking it


def _is_there(number: int, inside: int) -> bool:
    """Whether an open lock file is still the one in the folder."""
    try:
        return os.path.samestat(os.fstat(number), os.stat(LOCK, dir_fd=inside, follow_symlinks=False))
    except FileNotFoundError:
        return False


def _this_process() -> str:
    now = datetime.datetime.now().isoformat(sep=" ", timespec="seconds")
    return f"process {os.getpid()} of {socket.gethostname()} ({shown(' '.join(sys.argv))}, since {now})"
