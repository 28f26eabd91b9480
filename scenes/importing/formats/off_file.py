"""Read OFF: the text formats of three coordinates, also with normals, colours and texture coordinates.

trimesh cuts polygons into fans, and refuses normals and texture coordinates.
"""

from __future__ import annotations

import re
from array import array
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from trimesh import Trimesh

from scenes.files.errors import InputError, shown
from scenes.importing.formats.mesh_part import ImportedFile, parts_of_node, require_few
from scenes.importing.formats.polygons import cut_polygons
from scenes.importing.formats.text_lines import comment_header, coordinates, text_lines, whole_numbers

KEYWORD = re.compile(r"(ST)?C?N?OFF([0-9]*)")
"""Geomview's keyword: with texture coordinates, colours and normals after the coordinates of a vertex.

The files of ModelNet have the number of vertices in the same word.
"""


def read_off(data: bytes, path: Path) -> ImportedFile:
    """Read the polygons of an OFF file as one part, named after the file."""
    label = str(path)
    comments: list[str] = []
    lines = _rows(data, comments)
    number, words = _next(lines, path, "OFF")
    keyword = KEYWORD.fullmatch(words[0])
    if keyword is None or "BINARY" in words:
        raise InputError(f"{path}: expected OFF as text with three coordinates, found {shown(' '.join(words))}")
    words = [word for word in (keyword[2], *words[1:]) if word]
    if not words:
        number, words = _next(lines, path, "the numbers of vertices and faces")
    vertex_count, face_count = _counts(words[:2], 2, label, number)

    positions, corners, sizes, others = array("d"), array("q"), array("q"), 0
    for k in range(vertex_count):
        number, words = _next(lines, path, f"{vertex_count} vertices, of which there are {k}")
        positions.extend(coordinates(words, label, number))
    for k in range(face_count):
        number, words = _next(lines, path, f"{face_count} faces, of which there are {k}")
        (size,) = _counts(words[:1], 1, label, number)
        while len(words) <= size:  # libigl's test data have faces of several lines
            words += _next(lines, path, f"{face_count} faces, of which there are {k}")[1]
        face = _counts(words[1 : size + 1], size, label, number)  # colours may follow
        if size < 3:
            others += 1
            continue
        corners.extend(face)
        sizes.append(size)
        require_few(len(sizes), label)
    further = [number for number, _ in lines]
    vertices = np.frombuffer(positions).reshape(-1, 3)
    cut = cut_polygons(vertices, np.frombuffer(corners, np.int64), np.frombuffer(sizes, np.int64), label)
    mesh = Trimesh(vertices, cut.triangles, process=False)
    left_out = [f"faces of fewer than three corners were left out: {others} in the file"] if others else []
    if further:
        left_out.append(f"lines after the {face_count} faces were left out: {len(further)}, from line {further[0]} on")
    parts = parts_of_node("", path.stem, {None: mesh})
    return ImportedFile(path, parts, "z", (*left_out, *cut.remarks()), comment_header(comments))


def _rows(data: bytes, comments: list[str]) -> Iterator[tuple[int, list[str]]]:
    """Yield the words of each line that has any. Add the comments before the vertices to the list."""
    rows = 0
    for number, line in text_lines(data):
        content, hash_sign, comment = line.partition("#")
        if hash_sign and rows < 2:
            comments.append(comment)
        words = content.split()
        if words:
            rows += 1
            yield number, words


def _next(lines: Iterator[tuple[int, list[str]]], path: Path, expected: str) -> tuple[int, list[str]]:
    row = next(lines, None)
    if row is None:
        raise InputError(f"{path}: expected {expected}, found the end of the file")
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
