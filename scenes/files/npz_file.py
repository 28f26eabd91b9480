"""Write an .npz archive, and read one that the user gave: what each array must be is checked before it is read."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

import numpy as np

from scenes.files.atomic import write_atomically
from scenes.files.errors import InputError, reason
from scenes.files.input_file import MEGABYTE, require_regular

COMPRESSIONS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
"""Those of ``numpy.savez`` and ``numpy.savez_compressed``."""

MOST_MEMBERS = 100
"""Number of arrays in an archive, of which others than the expected ones are not read."""

KINDS = {"c": "complex numbers", "f": "numbers", "b": "truth values"}
"""What an array can be expected to hold, by NumPy's codes; numbers may be real or whole."""


@dataclass(frozen=True)
class Expected:
    """What an array of an archive must be.

    Attributes:
        what: what it is, for messages, e.g. "responses of 5 positions × 16 elements".
        kind: one of ``KINDS``.
        shape: lengths along its axes; None: any length.
        optional: whether the archive may lack it.
    """

    what: str
    kind: str
    shape: tuple[int | None, ...] = ()
    optional: bool = False

    def allows(self, dtype: np.dtype, shape: tuple[int, ...]) -> bool:
        """Whether an array has the kind and the shape."""
        kind = "f" if dtype.kind in "iu" else dtype.kind
        pairs = zip(self.shape, shape, strict=False)
        return kind == self.kind and len(shape) == len(self.shape) and all(want in (None, has) for want, has in pairs)


def read_npz(path: Path, what: str, arrays: Mapping[str, Expected], limit: int) -> dict[str, np.ndarray]:
    """Read arrays of an .npz archive.

    Args:
        path: the archive.
        what: what it should be, for messages, e.g. "an npz archive of responses".
        arrays: what its arrays must be, by name; others in the archive are not read.
        limit: largest size of the archive, and of each array, bytes.

    Returns:
        The arrays, by name, without optional ones that are not there.

    Raises:
        InputError: not a regular file within the limit, not a whole archive of plain arrays, encrypted, compressed in a
            way that NumPy does not, or an array is missing, of another kind or shape, or too large.
    """
    require_regular(path, what, limit)
    try:
        with zipfile.ZipFile(path) as archive:
            members = _members(path, what, archive)
            missing = [name for name, each in arrays.items() if name not in members and not each.optional]
            if missing:
                raise InputError(f"{path}: expected {what} with the array {missing[0]}, found none")
            present = {name: members[name] for name in arrays if name in members}
            for name, member in present.items():
                _check(path, archive, member, name, arrays[name], limit)
            return {name: _read(archive, member) for name, member in present.items()}
    except InputError:
        raise
    except Exception as error:  # damage makes zipfile, zlib and NumPy raise errors of many classes
        raise InputError(f"{path}: expected {what}, found a damaged file ({reason(error)})") from error


def _members(path: Path, what: str, archive: zipfile.ZipFile) -> dict[str, zipfile.ZipInfo]:
    """The archive's arrays, by name."""
    every = archive.infolist()
    if len(every) > MOST_MEMBERS:
        raise InputError(f"{path}: expected {what} with at most {MOST_MEMBERS} arrays, found {len(every)}")
    members = {member.filename.removesuffix(".npy"): member for member in every}
    if len(members) < len(every):
        raise InputError(f"{path}: expected {what} with arrays of different names, found one name twice")
    return members


def _check(
    path: Path, archive: zipfile.ZipFile, member: zipfile.ZipInfo, name: str, expected: Expected, limit: int
) -> None:
    """Refuse an array by its header, without reading its numbers."""
    where = f"{path}, array {name}"
    if member.flag_bits & 1:
        raise InputError(f"{where}: expected one that is not encrypted, found an encrypted one")
    if member.compress_type not in COMPRESSIONS:
        raise InputError(f"{where}: expected one stored or deflated, found compression {member.compress_type}")
    if member.file_size > limit:
        raise InputError(f"{where}: expected at most {limit / MEGABYTE:g} MB, found {member.file_size / MEGABYTE:.4g}")
    with archive.open(member) as file:
        version = np.lib.format.read_magic(file)
        if version != (1, 0):  # of headers that may have any length; no array of plain numbers needs one
            raise InputError(f"{where}: expected version 1.0 of NumPy's format, found {version[0]}.{version[1]}")
        shape, _, dtype = np.lib.format.read_array_header_1_0(file)
        size = member.file_size - file.tell()
    if not expected.allows(dtype, shape):
        kind = KINDS[expected.kind]
        raise InputError(f"{where}: expected {expected.what} ({kind}), found shape {shape} of {dtype}")
    count = 1
    for length in shape:  # not np.prod, whose whole numbers have 64 bits
        count *= length
    if min(shape, default=0) < 0 or count * dtype.itemsize != size:
        raise InputError(f"{where}: expected the {size} bytes that follow its header, found shape {shape} of {dtype}")


def _read(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> np.ndarray:
    with archive.open(member) as file:
        return np.lib.format.read_array(file, allow_pickle=False)


def write_arrays(path: Path, arrays: dict[str, np.ndarray]) -> None:
    """Write an .npz of named arrays, atomically."""
    buffer = BytesIO()
    np.savez(buffer, **arrays)  # type: ignore[arg-type]
    write_atomically(path, buffer.getvalue())
