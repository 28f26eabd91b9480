"""Write .npz archives, and read those of the user. The header of each array is checked before it is read."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import IO

import numpy as np

from scenes.files.atomic import write_atomically
from scenes.files.errors import InputError, reason
from scenes.files.input_file import MEGABYTE, require_regular

COMPRESSIONS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
"""Compression methods of ``numpy.savez`` and ``numpy.savez_compressed``."""

MOST_MEMBERS = 100  # Most arrays in an archive

KINDS = {"c": "complex numbers", "f": "numbers", "b": "truth values"}
"""Kinds of numbers in an array, by NumPy's codes. Whole numbers count as "f", too."""


@dataclass(frozen=True)
class Expected:
    what: str  # description of the array, for messages, e.g. "responses of 5 positions × 16 elements".
    kind: str  # one of ``KINDS``
    shape: tuple[int | None, ...] = ()  # length along each axis, None for any length
    optional: bool = False  # whether the array may be missing

    def allows(self, dtype: np.dtype, shape: tuple[int, ...]) -> bool:
        kind = "f" if dtype.kind in "iu" else dtype.kind
        pairs = zip(self.shape, shape, strict=False)
        return kind == self.kind and len(shape) == len(self.shape) and all(want in (None, has) for want, has in pairs)


def read_npz(path: Path, what: str, arrays: Mapping[str, Expected], limit: int) -> dict[str, np.ndarray]:
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
    except Exception as error:  # zipfile, zlib and NumPy raise many kinds of errors for damaged files
        raise InputError(f"{path}: expected {what}, found a damaged file ({reason(error)})") from error


def read_npy(path: Path, expected: Expected, limit: int) -> np.ndarray:
    require_regular(path, expected.what, limit)
    try:
        with path.open("rb") as file:
            _check_header(str(path), file, path.stat().st_size, expected)
            file.seek(0)
            return np.lib.format.read_array(file, allow_pickle=False)
    except InputError:
        raise
    except Exception as error:  # NumPy raises many kinds of errors for damaged files
        raise InputError(f"{path}: expected {expected.what}, found a damaged file ({reason(error)})") from error


def _members(path: Path, what: str, archive: zipfile.ZipFile) -> dict[str, zipfile.ZipInfo]:
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
    """Check an array by its header, without reading its numbers."""
    where = f"{path}, array {name}"
    if member.flag_bits & 1:
        raise InputError(f"{where}: expected an array that is not encrypted, found an encrypted one")
    if member.compress_type not in COMPRESSIONS:
        raise InputError(
            f"{where}: expected an array that is stored or deflated, found compression method {member.compress_type}"
        )
    if member.file_size > limit:
        raise InputError(
            f"{where}: expected at most {limit / MEGABYTE:g} MB, found {member.file_size / MEGABYTE:.4g} MB"
        )
    with archive.open(member) as file:
        _check_header(where, file, member.file_size, expected)


def _check_header(where: str, file: IO[bytes], length: int, expected: Expected) -> None:
    """Check the header of an array in NumPy's format, of which the whole has so many bytes."""
    version = np.lib.format.read_magic(file)
    if version != (1, 0):  # later versions allow long headers, which arrays of plain numbers do not need
        raise InputError(f"{where}: expected version 1.0 of NumPy's format, found {version[0]}.{version[1]}")
    shape, _, dtype = np.lib.format.read_array_header_1_0(file)
    size = length - file.tell()
    if not expected.allows(dtype, shape):
        kind = KINDS[expected.kind]
        raise InputError(f"{where}: expected {expected.what} ({kind}), found shape {shape} of {dtype}")
    count = 1
    for each in shape:  # np.prod would overflow at 64 bits
        count *= each
    if min(shape, default=0) < 0 or count * dtype.itemsize != size:
        raise InputError(f"{where}: expected a shape that fits its {size} bytes, found {shape} of {dtype}")


def _read(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> np.ndarray:
    with archive.open(member) as file:
        return np.lib.format.read_array(file, allow_pickle=False)


def write_arrays(path: Path, arrays: dict[str, np.ndarray]) -> None:
    """Write an .npz of named arrays, atomically."""
    buffer = BytesIO()
    np.savez(buffer, **arrays)  # type: ignore[arg-type]
    write_atomically(path, buffer.getvalue())
