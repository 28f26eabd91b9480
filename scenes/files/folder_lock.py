"""Lock an output folder: one process at a time writes to it. A second one is told at once which process that is."""

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
"""The file that a process locks while it writes to a folder. A killed process leaves the file behind, unlocked."""

NO_LOCKS = (errno.ENOSYS, errno.EOPNOTSUPP, errno.ENOTSUP, errno.ENOLCK)
"""Errors of network disks that cannot lock files."""

LONGEST = 1000
"""Most bytes of another process's lock file that are read."""


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
