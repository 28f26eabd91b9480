"""Read OFF: the text formats of three coordinates, also with normals, colours and texture coordinates.

trimesh cuts polygons into fans, and refuses normals and texture coordinates.
"""

from __future__ import annotations

import re
from array import array
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from scenes.files.errors import InputError, shown
from scenes.importing.formats.mesh_part import ImportedFile, require_few
from scenes.importing.formats.polygons import one_part
from scenes.importing.formats.text_lines import coordinates, text_lines, whole_numbers

KEYWORD = re.compile(r"(ST)?C?N?OFF([0-9]*)")
"""Geomview's keyword: with texture coordinates, colours and normals after the coordinates of a vertex.

The files of ModelNet have the number of vertices in the same word.
"""

Rows = Iterator[tuple[int, list[str]]]
"""Numbers and words of the lines that have any, without comments."""


def read_off(data: bytes, path: Path) -> ImportedFile:
    """Read the polygons of an OFF file as one part, named after the file."""
    label = str(path)
    stripped = ((number, line.partition("#")[0].split()) for number, line in text_lines(data))
    rows = ((number, words) for number, words in stripped if words)
    number, words = _next(rows, label, "OFF")
    keyword = KEYWORD.fullmatch(words[0])
    if keyword is None or "BINARY" in words:
        raise InputError(f"{path}: expected OFF as text with three coordinates, found {shown(' '.join(words))}")
    words = [word for word in (keyword[2], *words[1:]) if word]
    if not words:
        number, words = _next(rows, label, "the numbers of vertices and faces")
    vertex_count, face_count = _counts(words[:2], 2, label, number)

    positions, corners, sizes = array("d"), array("q"), array("q")
    for k in range(vertex_count):
        number, words = _next(rows, label, f"{vertex_count} vertices, of which there are {k}")
        positions.extend(coordinates(words, label, number))
    for k in range(face_count):
        number, words = _next(rows, label, f"{face_count} faces, of which there are {k}")
        (size,) = _counts(words[:1], 1, label, number)
        while len(words) <= size:  # libigl's test data have faces of several lines
            words += _next(rows, label, f"{face_count} faces, of which there are {k}")[1]
        corners.extend(_counts(words[1 : size + 1], size, label, number))  # colours may follow
        sizes.append(size)
        require_few(len(sizes), label)
    left_out = []
    if further := [number for number, _ in rows]:
        left_out = [f"lines after the {face_count} faces were left out: {len(further)}, from line {further[0]} on"]
    vertices = np.frombuffer(positions).reshape(-1, 3)
    faces = np.frombuffer(corners, np.int64), np.frombuffer(sizes, np.int64)
    return one_part(path, vertices, *faces, left_out)


def _next(rows: Rows, label: str, expected: str) -> tuple[int, list[str]]:
    row = next(rows, None)
    if row is None:
        raise InputError(f"{label}: expected {expected}, found the end of the file")
    return row


def _counts(words: list[str], count: int, label: str, line: int) -> list[int]:
    try:
        values = whole_numbers(words)
    except ValueError:
        values = []
    if len(values) != count or min(values, default=0) < 0:
        raise InputError(
            f"{label}: line {line}: expected {count} whole numbers of at least 0, found {shown(' '.join(words))}"
        )
    return values
