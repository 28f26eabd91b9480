"""Read PLY: polygons, from tables whose cells are numbers or lists of numbers.

trimesh cuts polygons into fans, and refuses binary files in which triangles and larger polygons are mixed. plyfile's
licence is not compatible with ours. A text is read as if all its numbers were binary, in double precision.
"""

from __future__ import annotations

import re
from array import array
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from jaxtyping import Float, Integer
from trimesh import Trimesh

from scenes.files.errors import InputError, named, shown
from scenes.importing.formats.mesh_part import ImportedFile, parts_of_node
from scenes.importing.formats.polygons import cut_polygons
from scenes.importing.formats.text_lines import comment_header, decimals, text_lines, whole_numbers

LONGEST_HEADER = 100_000  # Bytes

TYPES = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"},
    **{"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4"},
    **{"int64": "i8", "uint64": "u8"},
    **{"float": "f4", "double": "f8", "float16": "f2", "float32": "f4", "float64": "f8"},
}

ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">", "ascii": ""}


@dataclass(frozen=True)
class Property:
    """A column of numbers or, if it has a type for their lengths, of lists of numbers."""

    name: str
    type: np.dtype
    length: np.dtype | None = None


@dataclass(frozen=True)
class Column:
    """The lists of all rows; a number is a list of one."""

    lengths: Integer[np.ndarray, " R"]  # number of values in each row
    values: np.ndarray  # those of all rows, one row after the other


@dataclass
class Element:
    """A table, such as "vertex" or "face", with its number of rows and its columns by name."""

    name: str
    count: int
    properties: list[Property] = field(default_factory=list)
    columns: dict[str, Column] = field(default_factory=dict)


def read_ply(data: bytes, path: Path) -> ImportedFile:
    """Read the polygons of a PLY file as one part, named after the file."""
    label = str(path)
    elements, comments = _read_elements(data, label)
    if "tristrips" in elements:
        raise InputError(f"{label}: expected polygons, found triangle strips (tristrips); export it with faces instead")
    vertices = _vertices(elements.get("vertex"), label)
    sizes, corners = _corners(elements.get("face"), label)
    polygons = sizes >= 3
    left_out = [
        f"the element {named(element.name)} of the PLY was left out: {element.count} in the file"
        for element in elements.values()
        if element.name not in ("vertex", "face") and element.count
    ]
    if not polygons.all():
        left_out.append(f"faces of fewer than three corners were left out: {np.sum(~polygons)} in the file")
    cut = cut_polygons(vertices, corners[np.repeat(polygons, sizes)], sizes[polygons], label)
    mesh = Trimesh(vertices, cut.triangles, process=False)
    parts = parts_of_node("", path.stem, {None: mesh})
    return ImportedFile(path, parts, "z", (*left_out, *cut.remarks()), comment_header(comments))


def _vertices(element: Element | None, label: str) -> Float[np.ndarray, "V 3"]:
    if element is None or not element.count:
        return np.zeros((0, 3))
    missing = [
        axis for axis in "xyz" if axis not in element.columns or len(element.columns[axis].values) != element.count
    ]
    if missing:
        raise InputError(f"{label}: expected vertices of PLY with x, y and z, found none of {', '.join(missing)}")
    return np.stack([element.columns[axis].values for axis in "xyz"], axis=1).astype(float)


def _corners(element: Element | None, label: str) -> tuple[Integer[np.ndarray, " F"], Integer[np.ndarray, " C"]]:
    """Return the number of corners of each face, and the vertex numbers of the corners of all faces."""
    if element is None or not element.count:
        return np.zeros(0, int), np.zeros(0, int)
    columns = [element.columns[name] for name in ("vertex_indices", "vertex_index") if name in element.columns]
    if not columns:
        raise InputError(f"{label}: expected {named(element.name)} of PLY with vertex_indices, found none")
    column: Column = columns[0]
    whole = np.abs(column.values) < 2**53
    numbers = np.where(whole, column.values, -1).astype(int)
    if not (numbers == column.values).all():
        raise InputError(f"{label}: expected whole numbers as vertex_indices of PLY, found others")
    return column.lengths, numbers


def _read_elements(data: bytes, label: str) -> tuple[dict[str, Element], list[str]]:
    lines, start = _header_lines(data, label)
    order, elements, comments = _parse_header(lines, label)
    body = data[start:]
    if order == "":
        body = _text_rows(body, elements, label).tobytes()
        elements = [_in_double_precision(element) for element in elements]
    offset = 0
    for element in elements:
        offset = _read_rows(body, offset, element, label)
    if offset < len(body):
        raise InputError(f"{label}: expected as many rows as the header of PLY claims, found more")
    return {element.name: element for element in elements}, comments


def _header_lines(data: bytes, label: str) -> tuple[list[str], int]:
    """Return the lines of the header, and where the body begins."""
    if data[:3] != b"ply":
        raise InputError(f"{label}: expected a mesh as PLY, which begins with ply, found {shown(data[:10])}")
    end = re.search(rb"[\r\n]end_header *(\r\n|[\r\n]|$)", data[:LONGEST_HEADER])
    if end is None:
        raise InputError(f"{label}: expected end_header in the first {LONGEST_HEADER} bytes of PLY, found none")
    return data[: end.start()].decode("latin-1").splitlines(), end.end()


def _parse_header(lines: list[str], label: str) -> tuple[str, list[Element], list[str]]:
    """Return the order of the bytes, or "" for a text, the elements without their rows, and the comments."""
    order, elements, comments = None, [], []
    for line in lines[1:]:
        words = line.split()
        try:
            match words:
                case ["format", kind, _]:
                    order = ORDERS[kind]
                case ["element", name, count]:
                    elements.append(Element(name, whole_numbers([count])[0]))
                case ["property", "list", length, kind, name] if TYPES[length][0] != "f":
                    types = (np.dtype((order or "") + TYPES[each]) for each in (kind, length))
                    elements[-1].properties.append(Property(name, *types))
                case ["property", kind, name]:
                    elements[-1].properties.append(Property(name, np.dtype((order or "") + TYPES[kind])))
                case ["format" | "element" | "property", *_]:
                    raise ValueError
                case ["comment" | "obj_info", *_]:
                    comments.append(line.partition(" ")[2])
                case _:  # some exporters leave out "comment"
                    comments.append(line)
        except (IndexError, KeyError, ValueError):
            raise InputError(f"{label}: expected a header of PLY, found the line {shown(line)}") from None
    names = [element.name for element in elements]
    names += [f"{element.name} {each.name}" for element in elements for each in element.properties]
    if order is None or len(set(names)) < len(names) or any(element.count < 0 for element in elements):
        raise InputError(f"{label}: expected a header of PLY with a format and each name once, found another")
    return order, elements, comments


def _text_rows(body: bytes, elements: list[Element], label: str) -> array:
    """Return the numbers of a text, without those that some exporters add at the end of a row."""
    numbers = array("d")
    lines = (line for _, line in text_lines(body) if line)
    for element in elements:
        for row in range(element.count if element.properties else 0):
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
        raise InputError(f"{label}: expected as many rows as the header of PLY claims, found more")
    return numbers


def _in_double_precision(element: Element) -> Element:
    double = np.dtype("f8")
    properties = [Property(each.name, double, None if each.length is None else double) for each in element.properties]
    return Element(element.name, element.count, properties)


def _read_rows(body: bytes, offset: int, element: Element, label: str) -> int:
    """Read the columns of an element, and return where it ends."""
    least = sum((each.length or each.type).itemsize for each in element.properties)
    if not element.count or not least:
        return offset
    table = _even_rows(body, offset, element)
    if table is not None:
        for each in element.properties:
            values = table[each.name]
            element.columns[each.name] = Column(np.full(element.count, values.shape[1]), values.reshape(-1))
        return offset + table.nbytes
    spans: dict[str, list[tuple[int, int]]] = {each.name: [] for each in element.properties}
    for _ in range(element.count):
        for each in element.properties:
            length = 1
            if each.length is not None:
                length = _length(body, offset, each.length)
                offset += each.length.itemsize
            if length < 0:
                raise _too_few(element, label)
            spans[each.name].append((offset, length))
            offset += length * each.type.itemsize
        if offset > len(body):
            raise _too_few(element, label)
    for each in element.properties:
        size = each.type.itemsize
        pieces = b"".join(body[start : start + length * size] for start, length in spans[each.name])
        lengths = np.array([length for _, length in spans[each.name]])
        element.columns[each.name] = Column(lengths, np.frombuffer(pieces, each.type))
    return offset


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
        if length < 0 or offset + (end - offset) * element.count > len(body):
            return None
    table = np.frombuffer(body, fields, element.count, offset)
    lists = [each.name for each in element.properties if each.length is not None]
    return table if all((table[f"{name} length"] == table[name].shape[1]).all() for name in lists) else None


def _length(body: bytes, offset: int, kind: np.dtype) -> int:
    """Return the length of a list, or -1 if there is none."""
    if offset + kind.itemsize > len(body):
        return -1
    value = np.frombuffer(body, kind, 1, offset)[0]
    return int(value) if 0 <= value <= len(body) and value == int(value) else -1


def _too_few(element: Element, label: str) -> InputError:
    return InputError(f"{label}: expected {named(element.name)} with {element.count} rows in PLY, found fewer")
