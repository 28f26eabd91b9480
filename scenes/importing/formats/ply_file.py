"""Read PLY: polygons and triangle strips.

trimesh cuts polygons into fans, and refuses binary files in which triangles and larger polygons are mixed.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from jaxtyping import Float, Integer
from trimesh import Trimesh

from scenes.files.errors import InputError, named
from scenes.importing.formats.mesh_checks import require_corners
from scenes.importing.formats.mesh_part import MeshFile, parts_of_node
from scenes.importing.formats.ply_elements import Column, Element, read_elements
from scenes.importing.formats.polygons import cut_polygons
from scenes.importing.formats.strips import strip_triangles
from scenes.importing.formats.text_lines import comment_header

READ = ("vertex", "face", "tristrips")
RESTART = -1
"""Vertex number after which a strip begins anew."""


def read_ply(data: bytes, path: Path) -> MeshFile:
    """Read the polygons and triangle strips of a PLY file as one part, named after the file."""
    label = str(path)
    elements, comments = read_elements(data, label)
    vertices = _vertices(elements.get("vertex"), label)
    sizes, corners = _corners(elements.get("face"), label)
    polygons = sizes >= 3
    left_out = [
        f"the element {named(element.name)} of the PLY was left out: {element.count} in the file"
        for element in elements.values()
        if element.name not in READ and element.count
    ]
    if not polygons.all():
        left_out.append(f"faces of fewer than three corners were left out: {np.sum(~polygons)} in the file")
    cut = cut_polygons(vertices, corners[np.repeat(polygons, sizes)], sizes[polygons], label)
    strips = _strips(elements.get("tristrips"), label)
    require_corners(strips, len(vertices), label)
    mesh = Trimesh(vertices, np.concatenate([cut.triangles, strips]), process=False)
    return MeshFile(parts_of_node("", path.stem, {None: mesh}), (*left_out, *cut.remarks()), comment_header(comments))


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
    numbers = np.where(whole, column.values, RESTART - 1).astype(int)
    if not (numbers == column.values).all():
        raise InputError(f"{label}: expected whole numbers as vertex_indices of PLY, found others")
    return column.lengths, numbers


def _strips(element: Element | None, label: str) -> Integer[np.ndarray, "t 3"]:
    lengths, corners = _corners(element, label)
    ends = np.flatnonzero(corners == RESTART)
    pieces = [piece[piece != RESTART] for piece in np.split(corners, np.union1d(ends, np.cumsum(lengths)))]
    return np.concatenate([np.zeros((0, 3), int), *map(strip_triangles, pieces)])
