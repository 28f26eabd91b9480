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
from scenes.importing.formats.text_lines import comment_header, coordinates, text_lines, whole_numbers

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


class _Polygons:
    """The polygons of a file, and the object, group and material of each."""

    def __init__(self, label: str) -> None:
        self.label = label
        self.positions, self.corners, self.sizes, self.owners = array("d"), array("q"), array("q"), array("q")
        self.owner_numbers: dict[tuple[str, str, str], int] = {}
        self.left_out = Counter[str]()
        self.comments: list[str] = []

    def read(self, data: bytes) -> None:
        obj = group = material = ""
        for number, line in _statements(data):
            keyword, _, rest = line.partition(" ")
            if not keyword:
                continue
            if keyword == "v":
                self.positions.extend(coordinates(_words(rest), self.label, number))
            elif keyword in ("f", "fo"):
                self._add_face(_words(rest), (obj, group, material), number)
            elif keyword == "o":
                obj = rest.strip()
            elif keyword == "g":
                group = rest.strip()
            elif keyword == "usemtl":
                material = rest.strip()
            elif keyword in LEFT_OUT:
                self.left_out[LEFT_OUT[keyword]] += 1
            elif keyword.startswith("#"):
                if not self.positions:
                    self.comments.append(line[1:])
            elif keyword not in IRRELEVANT:
                self.left_out["statements that OBJ does not have"] += 1

    def _add_face(self, words: list[str], owner: tuple[str, str, str], line: int) -> None:
        count = len(self.positions) // 3
        try:
            corners = whole_numbers([word.partition("/")[0] for word in words])
        except ValueError:
            raise InputError(
                f"{self.label}: line {line}: expected vertex numbers, found {shown(' '.join(words))}"
            ) from None
        for corner in corners:
            if not 0 < abs(corner) <= count:
                raise InputError(
                    f"{self.label}: line {line}: expected vertex numbers from 1 to {count}, or from -{count} to -1, "
                    f"found {corner}"
                )
        if len(corners) < 3:
            self.left_out["faces of fewer than three corners"] += 1
            return
        self.corners.extend(corner - 1 if corner > 0 else count + corner for corner in corners)
        self.sizes.append(len(corners))
        self.owners.append(self.owner_numbers.setdefault(owner, len(self.owner_numbers)))
        require_few(len(self.sizes), self.label)


def read_obj(data: bytes, path: Path) -> ImportedFile:
    """Read the polygons of an OBJ file, with a part for each object, group and material."""
    read = _Polygons(str(path))
    read.read(data)
    vertices = np.frombuffer(read.positions).reshape(-1, 3)
    corners, sizes, owners = (np.frombuffer(each, np.int64) for each in (read.corners, read.sizes, read.owners))
    used = np.unique(corners)  # points of a cloud that no polygon uses are not checked
    cut = cut_polygons(vertices[used], np.searchsorted(used, corners), sizes, str(path))
    return ImportedFile(
        path,
        _parts(vertices[used], cut, owners, list(read.owner_numbers), path.stem),
        "z",
        (*(f"{what} were left out: {count} in the file" for what, count in read.left_out.items()), *cut.remarks()),
        comment_header(read.comments),
    )


def _parts(
    vertices: np.ndarray, cut: Cut, owners: np.ndarray, names: list[tuple[str, str, str]], stem: str
) -> list[ImportedPart]:
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
        if line.endswith("\\") and not (len(pieces) == 1 and line.lstrip().startswith("#")):
            continue
        yield first, " ".join(pieces)
        pieces = []
    yield first, " ".join(pieces)


def _words(rest: str) -> list[str]:
    return rest.partition("#")[0].split()
