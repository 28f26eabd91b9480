"""Read a file that the user gave: a regular file of a bounded size, and no device, pipe or socket."""

from __future__ import annotations

import os
import stat
from pathlib import Path, PurePath

from scenes.files.errors import InputError, shown

MEGABYTE = 10**6


def require_regular(path: Path, expected: str, limit: int) -> None:
    """Refuse what is not a regular file of at most a number of bytes. The file is not opened: a pipe would block.

    Args:
        path: the file.
        expected: what should be there, for the message, e.g. "a CSV of positions".
        limit: largest size, bytes.

    Raises:
        InputError: there is no such file, it is of another kind, or it is larger.
    """
    try:
        status = os.stat(path)
    except FileNotFoundError:
        raise InputError(f"{path}: expected {expected}, found no such file") from None
    except (OSError, ValueError) as error:  # ValueError: a name with a null character
        reason = error.strerror if isinstance(error, OSError) else error
        raise InputError(f"{path}: expected {expected}, found that it cannot be read ({reason})") from None
    if not stat.S_ISREG(status.st_mode):
        raise InputError(f"{path}: expected {expected}, found {_kind(status.st_mode)}")
    if status.st_size > limit:
        raise InputError(
            f"{path}: expected {expected} of at most {limit / MEGABYTE:g} MB, found {status.st_size / MEGABYTE:.4g} MB"
        )


def read_bytes(path: Path, expected: str, limit: int) -> bytes:
    """All bytes of a file that ``require_regular`` accepts; InputError where it does not, or it cannot be read."""
    require_regular(path, expected, limit)
    try:
        return path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: expected {expected}, found that it cannot be read ({error.strerror})") from None


def read_text(path: Path, expected: str, limit: int) -> str:
    """All text of a file, without a byte order mark; InputError where ``read_bytes`` raises it, or it is not UTF-8."""
    try:
        return read_bytes(path, expected, limit).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: expected {expected}, found no UTF-8 text ({error.reason})") from None


def beside(path: Path, name: str) -> Path:
    """The path of a file that another one names: in its folder or below, so that a folder can be moved as it is.

    Args:
        path: the file that names the other one.
        name: the name it gives, relative to its folder.

    Raises:
        InputError: an absolute path, or one that leaves the folder.

    >>> str(beside(Path("room/scene.yaml"), "meshes/wall.ply"))
    'room/meshes/wall.ply'
    """
    parts = PurePath(name)
    if parts.is_absolute() or ".." in parts.parts:
        raise InputError(f"expected a file in the folder {path.parent} or below, found {shown(name)}")
    return path.parent / parts


def _kind(mode: int) -> str:
    kinds = {
        stat.S_IFDIR: "a folder",
        stat.S_IFIFO: "a named pipe",
        stat.S_IFSOCK: "a socket",
        stat.S_IFCHR: "a device",
        stat.S_IFBLK: "a device",
    }
    return kinds.get(stat.S_IFMT(mode), "something else")
