"""Read Wavefront OBJ: polygons by object, group and material. trimesh cuts polygons into fans."""

from __future__ import annotations

from array import array
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from trimesh import Trimesh

from scenes.files.errors import InputError, shown
from scenes.importing.formats.mesh_part import ImportedFile, ImportedPart, parts_of_node, require_few
from scenes.importing.formats.polygons import Cut, cut_polygons
from scenes.importing.formats.text_lines import coordinates, text_lines, whole_numbers

LEFT_OUT = {
    "p": "points",
    "l": "lines",
    "curv": "free-form curves",
    "curv2": "free-form curves",
    "surf": "free-form surfaces",
    "call": "calls of other files",
}
"""Statements of geometry that are not polygons."""

IRRELEVANT = frozenset(
    "vn vt vp mtllib maplib usemap lod s mg bevel c_interp d_interp shadow_obj trace_obj "
    "cstype deg bmat step parm trim hole scrv sp end con ctech stech bsp bzp cdc cdp res csh".split()
)
"""Statements of normals, textures, smoothing, and attributes of what is left out."""

Owner = tuple[str, str, str]  # Object, group and material of a polygon


def read_obj(data: bytes, path: Path) -> ImportedFile:
    """Read the polygons of an OBJ file, with a part for each object, group and material."""
    positions, corners, sizes, owners = array("d"), array("q"), array("q"), array("q")
    numbers: dict[Owner, int] = {}
    others = Counter[str]()
    blender = False
    obj = group = material = ""
    for line, text in _statements(data):
        keyword, _, rest = text.partition(" ")
        words = rest.partition("#")[0].split()
        if keyword == "v":
            positions.extend(coordinates(words, str(path), line))
        elif keyword in ("f", "fo"):
            face = _corners(words, len(positions) // 3, f"{path}: line {line}")
            corners.extend(face)
            sizes.append(len(face))
            owners.append(numbers.setdefault((obj, group, material), len(numbers)))
            require_few(len(sizes), str(path))
        elif keyword == "o":
            obj = rest.strip()
        elif keyword == "g":
            group = rest.strip()
        elif keyword == "usemtl":
            material = rest.strip()
        elif keyword in LEFT_OUT:
            others[LEFT_OUT[keyword]] += 1
        elif keyword.startswith("#"):
            blender |= not positions and "blender" in text.lower()
        elif keyword and keyword not in IRRELEVANT:
            others["statements that OBJ does not have"] += 1
    vertices = np.frombuffer(positions).reshape(-1, 3)
    used, which = np.unique(np.frombuffer(corners, np.int64), return_inverse=True)
    vertices = vertices[used]  # points of a cloud that no polygon uses are not checked
    cut = cut_polygons(vertices, which, np.frombuffer(sizes, np.int64), str(path))
    parts = _parts(vertices, cut, np.frombuffer(owners, np.int64), list(numbers), path.stem)
    left_out = [f"{what} were left out: {count} in the file" for what, count in others.items()]
    return ImportedFile(path, parts, "z", (*left_out, *cut.remarks()), blender)


def _corners(words: list[str], count: int, place: str) -> list[int]:
    """Return the vertex numbers of a face, from 0. Negative ones in the file count back from the last vertex so far."""
    try:
        corners = whole_numbers([word.partition("/")[0] for word in words])
    except ValueError:
        raise InputError(f"{place}: expected vertex numbers, found {shown(' '.join(words))}") from None
    for corner in corners:
        if not 0 < abs(corner) <= count:
            expected = f"expected vertex numbers from 1 to {count}, or from -{count} to -1"
            raise InputError(f"{place}: {expected}, found {corner}")
    return [corner - 1 if corner > 0 else count + corner for corner in corners]


def _parts(vertices: np.ndarray, cut: Cut, owners: np.ndarray, names: list[Owner], stem: str) -> list[ImportedPart]:
    """Divide the triangles by object and group, and these by material."""
    owner = owners[cut.polygons]
    nodes: dict[tuple[str, str], dict[str | None, Trimesh]] = {}
    order = np.argsort(owner, kind="stable")
    bounds = np.searchsorted(owner[order], np.arange(len(names) + 1))
    for number, (obj, group, material) in enumerate(names):
        faces = cut.triangles[order[bounds[number] : bounds[number + 1]]]
        if len(faces):
            used, corners = np.unique(faces, return_inverse=True)
            mesh = Trimesh(vertices[used], corners.reshape(-1, 3), process=False)
            nodes.setdefault((obj, group), {})[material or None] = mesh
    named_nodes = (("_".join(filter(None, node)), meshes) for node, meshes in nodes.items())
    return [part for node, meshes in named_nodes for part in parts_of_node(node, stem, meshes)]


def _statements(data: bytes) -> Iterator[tuple[int, str]]:
    """Yield the lines, each joined with those that continue it after a backslash. Comments have no further lines."""
    pieces: list[str] = []
    first = 0
    for number, line in text_lines(data):
        first = first if pieces else number
        pieces.append(line.removesuffix("\\").replace("\t", " "))
        if line.endswith("\\") and not (len(pieces) == 1 and line.startswith("#")):
            continue
        yield first, " ".join(pieces)
        pieces = []
    yield first, " ".join(pieces)
