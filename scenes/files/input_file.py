"""Read a file from the user: a regular one of limited size, not a device or pipe, and numbers that are written in it.

Python's ``float`` and ``int`` read more than numbers: 1_0 is 10 for them, and full-width or Arabic digits count, too.
In a table of positions these are typing errors.
"""

from __future__ import annotations

import os
import re
import stat
from pathlib import Path, PurePath

from scenes.files.errors import InputError, shown

MEGABYTE = 10**6


def require_regular(path: Path, expected: str, limit: int) -> None:
    """Refuse a path that is not a regular file of limited size. The file is not opened, since a pipe would block."""
    try:
        status = os.stat(path)
    except FileNotFoundError:
        raise InputError(f"{path}: expected {expected}, found no such file") from None
    except (OSError, ValueError) as error:  # ValueError: a name with a null character
        reason = error.strerror if isinstance(error, OSError) else error
        raise InputError(f"{path}: expected {expected}, found a file that cannot be read ({reason})") from None
    if not stat.S_ISREG(status.st_mode):
        raise InputError(f"{path}: expected {expected}, found {_kind(status.st_mode)}")
    if status.st_size > limit:
        raise InputError(
            f"{path}: expected {expected} of at most {limit / MEGABYTE:g} MB, found {status.st_size / MEGABYTE:.4g} MB"
        )


def read_bytes(path: Path, expected: str, limit: int) -> bytes:
    """Read a file as bytes. Raise an InputError if ``require_regular`` refuses it or it cannot be read."""
    require_regular(path, expected, limit)
    try:
        return path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: expected {expected}, found a file that cannot be read ({error.strerror})") from None


def read_text(path: Path, expected: str, limit: int) -> str:
    """Read a file as text, without a byte order mark. Raise an InputError as ``read_bytes``, or if it is not UTF-8."""
    try:
        return read_bytes(path, expected, limit).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: expected {expected}, found text that is not UTF-8 ({error.reason})") from None


def beside(path: Path, name: str) -> Path:
    """Return the path of a file that another file names."""
    parts = PurePath(name)
    if parts.is_absolute() or ".." in parts.parts:
        raise InputError(f"expected a file in the folder {path.parent} or below, found {shown(name)}")
    return path.parent / parts


def what_is_at(path: Path) -> str:
    """What is at a path where something else is expected, for a message."""
    try:
        return _kind(os.stat(path).st_mode)
    except OSError:
        return "a link to nothing" if path.is_symlink() else "nothing there"


def _kind(mode: int) -> str:
    kinds = {
        stat.S_IFREG: "a file",
        stat.S_IFDIR: "a folder",
        stat.S_IFIFO: "a named pipe",
        stat.S_IFSOCK: "a socket",
        stat.S_IFCHR: "a device",
        stat.S_IFBLK: "a device",
    }
    return kinds.get(stat.S_IFMT(mode), "something else")


WHOLE = re.compile(r"[-+]?[0-9]+")

NUMBER = re.compile(
    r"[-+]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][-+]?[0-9]+)?|[-+]?(nan|inf|infinity)", re.IGNORECASE | re.ASCII
)


def parse_number(text: str) -> float:
    """Read a number. Space around it is ignored. NaN and infinity are read, too, since range checks name them."""
    if not NUMBER.fullmatch(text.strip()):
        raise ValueError(f"expected a number, found {shown(text)}")
    return float(text)


def parse_whole(text: str) -> int:
    """Read a whole number. Space around it is ignored."""
    if not WHOLE.fullmatch(text.strip()):
        raise ValueError(f"expected a whole number, found {shown(text)}")
    return int(text)
