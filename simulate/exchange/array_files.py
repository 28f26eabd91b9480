"""Read the arrays of numbers in files of other programs: NumPy, MATLAB, HDF5, and tables of text."""

from __future__ import annotations

import csv
import io
import re
import zipfile
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import scipy.io

from scenes.files.errors import InputError, reason, shown
from scenes.files.input_file import MEGABYTE, read_bytes, read_text, require_regular

LARGEST = 2000 * MEGABYTE  # Most bytes of a file

MOST_ARRAYS = 1000  # Most arrays in a file

PARTS = ("r", "i"), ("real", "imag"), ("re", "im")
"""Names of the parts of a complex number in HDF5: of h5py, of MATLAB, and others."""

DECIMAL_COMMA = re.compile(r"[-+]?\d+,\d+([eE][-+]?\d+)?")

COMPLEX_PAIR = re.compile(
    r"(?P<stem>.*?)[ _.\-]?(?P<part>re|real|im|imag|imaginary)[ _.\-]?(?P<end>\d*)", re.IGNORECASE
)
PART_FIRST = re.compile(r"(?P<part>re|real|im|imag|imaginary)(?:[ _.\-](?P<stem>.+)|\((?P<inside>.+)\))", re.IGNORECASE)
"""Names of the parts of a complex number in a table: such as h1_re, re1, real_h1 and Re(h1)."""

Arrays = dict[str, np.ndarray]


def read_arrays(path: Path) -> Arrays:
    """Read all arrays of numbers in a file. Other content, such as texts, is left out.

    A table of text has a column for each array; pairs of columns such as ``h1_re`` and ``h1_im`` are one of complex
    numbers. Its columns are separated by commas, semicolons, tabs or spaces, and may have decimal commas.
    """
    ending = path.suffix.lower()
    if ending not in READERS:
        raise InputError(f"{path}: expected a file that ends in {', '.join(READERS)}, found {shown(path.name)}")
    require_regular(path, "arrays of numbers", LARGEST)
    try:
        found = READERS[ending](path)
    except InputError:
        raise
    except Exception as error:  # NumPy, SciPy and h5py raise many kinds of errors for damaged files
        raise InputError(f"{path}: expected arrays of numbers, found a damaged file ({reason(error)})") from error
    numbers = {name: each for name, each in found.items() if each.dtype.kind in "iufc" and each.size}
    if not numbers:
        raise InputError(f"{path}: expected arrays of numbers, found none")
    return numbers


def _numpy(path: Path) -> Arrays:
    content = io.BytesIO(read_bytes(path, "arrays of NumPy", LARGEST))
    if zipfile.is_zipfile(content):
        _require_small(path, sum(each.file_size for each in zipfile.ZipFile(content).infolist()))
    content.seek(0)
    loaded = np.load(content, allow_pickle=False)
    return {path.stem: loaded} if isinstance(loaded, np.ndarray) else {name: loaded[name] for name in loaded.files}


def _require_small(path: Path, size: int) -> None:
    """Refuse what is larger once it is unpacked than a file may be."""
    if size > LARGEST:
        raise InputError(f"{path}: expected at most {LARGEST // MEGABYTE} MB when unpacked, found {size // MEGABYTE}")


def _matlab(path: Path) -> Arrays:
    try:
        content = scipy.io.loadmat(io.BytesIO(read_bytes(path, "arrays of MATLAB", LARGEST)))
    except NotImplementedError:  # version 7.3 is HDF5, with the axes in reverse order
        return {name: each.T for name, each in _hdf5(path).items()}
    return {name: each for name, each in content.items() if isinstance(each, np.ndarray)}


def _hdf5(path: Path) -> Arrays:
    found: Arrays = {}

    def visit(name: str, item: h5py.Dataset | h5py.Group) -> None:
        if isinstance(item, h5py.Dataset) and len(found) < MOST_ARRAYS and not name.startswith("#"):
            _require_small(path, item.nbytes)
            found[name] = _plain(item)

    with h5py.File(path, "r") as file:
        file.visititems(visit)
    return found


def _plain(item: h5py.Dataset) -> np.ndarray:
    """The numbers of a dataset in HDF5; an empty array if it has none."""
    names = item.dtype.names
    if item.external or item.is_virtual:
        raise InputError(f"{item.file.filename}: expected arrays in the file itself, found {item.name} in another file")
    if names is None:
        return np.asarray(item[()])
    for real, imaginary in PARTS:
        if set(names) == {real, imaginary}:
            return np.asarray(item[real] + 1j * item[imaginary])
    return np.zeros(0)


def _table(path: Path) -> Arrays:
    lines = [line for line in read_text(path, "a table of numbers", LARGEST).splitlines() if line.strip()]
    if not lines:
        raise InputError(f"{path}: expected a table of numbers, found an empty file")
    separator = _separator(lines[0])
    rows = [_split(line.lstrip("#%"), separator) for line in lines]
    header = None if all(_is_number(cell) for cell in rows[0]) else rows.pop(0)
    width = len(header or rows[0])
    for number, row in enumerate(rows, start=1 if header is None else 2):
        if len(row) != width:
            raise InputError(f"{path}, row {number}: expected {width} columns, as in the first row, found {len(row)}")
    names = header or [str(number) for number in range(1, len(rows[0]) + 1)]
    alike = [name.strip().lower() for name in names]
    twice = next((name for name, each in zip(names, alike, strict=True) if each and alike.count(each) > 1), None)
    if twice is not None:
        raise InputError(f"{path}: expected columns of different names, found {shown(twice)} twice")
    columns = {name: [row[index] for row in rows] for index, name in enumerate(names)}
    return _with_complex({name: _numbers(path, name, cells) for name, cells in columns.items()})


def _separator(line: str) -> str | None:
    """The separator of a line of a table; None for spaces."""
    for separator in ";\t":
        if separator in line:
            return separator
    return "," if "," in line and not all(DECIMAL_COMMA.fullmatch(word) for word in line.split()) else None


def _split(line: str, separator: str | None) -> list[str]:
    if separator is None:
        return line.split()
    return [cell.strip() for cell in next(csv.reader([line], delimiter=separator))]


def _is_number(cell: str) -> bool:
    try:
        _number(cell)
    except ValueError:
        return False
    return True


def _number(cell: str) -> complex:
    plain = cell.replace(",", ".")  # a comma inside a cell is a decimal one
    return complex(plain.replace(" ", "").replace("i", "j") if plain.endswith(("i", "j")) else plain)


def _numbers(path: Path, name: str, cells: list[str]) -> np.ndarray:
    """A column of numbers, NaN where a cell is blank; an empty array if it holds other texts, or nothing."""
    if not any(cells):
        return np.zeros(0)
    cells = [cell or "nan" for cell in cells]
    try:
        values = np.array([_number(cell) for cell in cells])
    except ValueError:
        readable = [_is_number(cell) for cell in cells]
        if sum(readable) > len(cells) / 2:  # a column of numbers with something else in it
            row = readable.index(False)
            raise InputError(
                f"{path}, column {shown(name)}: expected a number in row {row + 1}, found {shown(cells[row])}"
            ) from None
        return np.zeros(0)
    return values if np.iscomplex(values).any() else values.real


def _with_complex(columns: Arrays) -> Arrays:
    """Columns, with the pairs of a real and an imaginary part as one."""
    found: dict[tuple[str, str], dict[str, str]] = {}
    for name in columns:
        first, last = PART_FIRST.fullmatch(name), COMPLEX_PAIR.fullmatch(name)
        match = last or first
        if match:
            part = "real" if match["part"].lower().startswith("re") else "imaginary"
            key = (last["stem"], last["end"]) if last else (match["stem"] or match["inside"], "")
            found.setdefault((key[0].lower(), key[1]), {})[part] = name
    pairs = {parts["real"]: (key, parts["imaginary"]) for key, parts in found.items() if len(parts) == 2}
    result: Arrays = {}
    for name, values in columns.items():
        if name in pairs:
            (stem, end), imaginary = pairs[name]
            result[f"{stem}{end}" or "responses"] = values + 1j * columns[imaginary]
        elif all(name != imaginary for _, imaginary in pairs.values()):
            result[name] = values
    return result


READERS: dict[str, Callable[[Path], Arrays]] = {
    ".npy": _numpy,
    ".npz": _numpy,
    ".mat": _matlab,
    ".h5": _hdf5,
    ".hdf5": _hdf5,
    ".csv": _table,
    ".tsv": _table,
    ".txt": _table,
}
"""How to read a file, by the end of its name."""
