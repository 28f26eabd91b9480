"""Read PLY: polygons, from tables whose cells are numbers or lists of numbers.

trimesh cuts polygons into fans, and refuses binary files in which triangles and larger polygons are mixed. plyfile's
licence is not compatible with ours. A text is read as if all its numbers were binary, in double precision.
"""

from __future__ import annotations

import re
from array import array
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Integer

from scenes.files.errors import InputError, named, shown
from scenes.importing.formats.mesh_part import ImportedFile
from scenes.importing.formats.polygons import one_part
from scenes.importing.formats.text_lines import decimals, text_lines, whole_numbers

LONGEST_HEADER = 100_000  # Bytes

TYPES = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"},
    **{"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4"},
    **{"int64": "i8", "uint64": "u8"},
    **{"float": "f4", "double": "f8", "float16": "f2", "float32": "f4", "float64": "f8"},
}

ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">", "ascii": ""}

DOUBLE = np.dtype("f8")


class Property(NamedTuple):
    """A column of numbers or, if it has a type for their lengths, of lists of numbers."""

    name: str
    type: np.dtype
    length: np.dtype | None = None


class Element(NamedTuple):
    """A table, such as "vertex" or "face", with its number of rows and its columns."""

    name: str
    rows: int
    properties: list[Property]


Columns = dict[str, tuple[Integer[np.ndarray, " R"], np.ndarray]]
"""By the names of an element's columns: how many values each row has, 1 if they are numbers, and the values of all."""


def read_ply(data: bytes, path: Path) -> ImportedFile:
    """Read the polygons of a PLY file as one part, named after the file."""
    label = str(path)
    order, elements, body = _header(data, label)
    if any(element.name == "tristrips" for element in elements):
        raise InputError(f"{label}: expected polygons, found triangle strips (tristrips); export it with faces instead")
    if order == "":
        body = _text_rows(body, elements, label).tobytes()
        elements = [
            Element(name, count, [Property(each.name, DOUBLE, None if each.length is None else DOUBLE) for each in own])
            for name, count, own in elements
        ]
    columns, offset = dict[str, Columns](), 0
    for element in elements:
        columns[element.name], offset = _rows(body, offset, element, label)
    if offset < len(body):
        raise _too_many(label)
    left_out = [
        f"the element {named(element.name)} of the PLY was left out: {element.rows} in the file"
        for element in elements
        if element.name not in ("vertex", "face") and element.rows
    ]
    vertices = _vertices(columns.get("vertex", {}), label)
    sizes, corners = _corners(columns.get("face", {}), label)
    return one_part(path, vertices, corners, sizes, left_out)


def _vertices(columns: Columns, label: str) -> Float[np.ndarray, "V 3"]:
    if not columns:
        return np.zeros((0, 3))
    missing = [axis for axis in "xyz" if axis not in columns or (columns[axis][0] != 1).any()]
    if missing:
        raise InputError(f"{label}: expected vertices of PLY with x, y and z, found none of {', '.join(missing)}")
    return np.stack([columns[axis][1] for axis in "xyz"], axis=1).astype(float)


def _corners(columns: Columns, label: str) -> tuple[Integer[np.ndarray, " F"], Integer[np.ndarray, " C"]]:
    """Return the number of corners of each face, and the vertex numbers of the corners of all faces."""
    if not columns:
        return np.zeros(0, int), np.zeros(0, int)
    found = columns.get("vertex_indices") or columns.get("vertex_index")
    if found is None:
        raise InputError(f'{label}: expected "face" of PLY with vertex_indices, found none')
    sizes, values = found
    numbers = np.where(np.abs(values) < 2**53, values, -1).astype(int)
    if not (numbers == values).all():
        raise InputError(f"{label}: expected whole numbers as vertex_indices of PLY, found others")
    return sizes, numbers


def _header(data: bytes, label: str) -> tuple[str, list[Element], bytes]:
    """Return the order of the bytes, or "" for a text, the elements, and what follows the header."""
    if data[:3] != b"ply":
        raise InputError(f"{label}: expected a mesh as PLY, which begins with ply, found {shown(data[:10])}")
    end = re.search(rb"[\r\n]end_header *(\r\n|[\r\n]|$)", data[:LONGEST_HEADER])
    if end is None:
        raise InputError(f"{label}: expected end_header in the first {LONGEST_HEADER} bytes of PLY, found none")
    order: str | None = None
    elements: list[Element] = []
    for line in data[: end.start()].decode("latin-1").splitlines()[1:]:
        try:
            match line.split():
                case ["format", kind, _]:
                    order = ORDERS[kind]
                case ["element", name, count]:
                    elements.append(Element(name, whole_numbers([count])[0], []))
                case ["property", "list", length, kind, name] if TYPES[length][0] != "f":
                    types = (np.dtype((order or "") + TYPES[each]) for each in (kind, length))
                    elements[-1].properties.append(Property(name, *types))
                case ["property", kind, name]:
                    elements[-1].properties.append(Property(name, np.dtype((order or "") + TYPES[kind])))
                case ["format" | "element" | "property", *_]:
                    raise ValueError  # other lines are comments; some exporters leave out "comment"
        except (IndexError, KeyError, ValueError):
            raise InputError(f"{label}: expected a header of PLY, found the line {shown(line)}") from None
    names = [element.name for element in elements]
    names += [f"{element.name} {each.name}" for element in elements for each in element.properties]
    if order is None or len(set(names)) < len(names) or any(element.rows < 0 for element in elements):
        raise InputError(f"{label}: expected a header of PLY with a format and each name once, found another")
    return order, elements, data[end.end() :]


def _text_rows(body: bytes, elements: Sequence[Element], label: str) -> array:
    """Return the numbers of a text, without those that some exporters add at the end of a row."""
    numbers = array("d")
    lines = (line for _, line in text_lines(body) if line)
    for element in elements:
        for row in range(element.rows if element.properties else 0):
            line = next(lines, None)
            if line is None:
                raise _too_few(element, label)
            words, end = line.split(), 0
            try:
                for each in element.properties:
                    end += 1 if each.length is None else 1 + whole_numbers(words[end : end + 1])[0]
                numbers.extend(decimals(words[:end]))
            except (IndexError, ValueError):
                end = len(words) + 1
            if end > len(words):
                raise InputError(
                    f"{label}: row {row} of {named(element.name)} in PLY: expected numbers for all properties, found "
                    f"{shown(line)}"
                )
    if next(lines, None) is not None:
        raise _too_many(label)
    return numbers


def _rows(body: bytes, offset: int, element: Element, label: str) -> tuple[Columns, int]:
    """Read the columns of an element, and return where it ends."""
    least = sum((each.length or each.type).itemsize for each in element.properties)
    if not element.rows or not least:
        return {}, offset
    table = _even_rows(body, offset, element)
    if table is not None:
        values = {each.name: table[each.name] for each in element.properties}
        columns = {name: (np.full(len(rows), rows.shape[1]), rows.reshape(-1)) for name, rows in values.items()}
        return columns, offset + table.nbytes
    pieces: dict[str, list[bytes]] = {each.name: [] for each in element.properties}
    for _ in range(element.rows):
        for each in element.properties:
            length = 1
            if each.length is not None:
                length = _length(body, offset, each.length)
                offset += each.length.itemsize
            end = offset + length * each.type.itemsize
            if length < 0 or end > len(body):
                raise _too_few(element, label)
            pieces[each.name].append(body[offset:end])
            offset = end
    columns = {}
    for each in element.properties:
        lengths = np.array([len(piece) for piece in pieces[each.name]]) // each.type.itemsize
        columns[each.name] = lengths, np.frombuffer(b"".join(pieces[each.name]), each.type)
    return columns, offset


def _even_rows(body: bytes, offset: int, element: Element) -> np.ndarray | None:
    """Return the rows as a table if their lists are as long as those of the first row, as in most files."""
    fields: list[tuple] = []
    end = offset
    for each in element.properties:
        length = 1
        if each.length is not None:
            length = _length(body, end, each.length)
            fields.append((f"{each.name} length", each.length))
            end += each.length.itemsize
        fields.append((each.name, each.type, (length,)))
        end += length * each.type.itemsize
        if length < 0 or offset + (end - offset) * element.rows > len(body):
            return None
    table = np.frombuffer(body, fields, element.rows, offset)
    lists = [each.name for each in element.properties if each.length is not None]
    return table if all((table[f"{name} length"] == table[name].shape[1]).all() for name in lists) else None


def _length(body: bytes, offset: int, kind: np.dtype) -> int:
    """Return the length of a list, or -1 if there is none."""
    if offset + kind.itemsize > len(body):
        return -1
    value = np.frombuffer(body, kind, 1, offset)[0]
    return int(value) if 0 <= value <= len(body) and value == int(value) else -1


def _too_few(element: Element, label: str) -> InputError:
    return InputError(f"{label}: expected {named(element.name)} with {element.rows} rows in PLY, found fewer")


def _too_many(label: str) -> InputError:
    return InputError(f"{label}: expected as many rows as the header of PLY claims, found more")
