"""Read STL, binary or text, with the names of its solids. trimesh takes a text that is cut off for an empty one."""

from __future__ import annotations

from array import array
from pathlib import Path

import numpy as np
from jaxtyping import Float
from trimesh import Trimesh

from scenes.files.errors import InputError, shown
from scenes.importing.formats.mesh_part import ImportedFile, ImportedPart, require_few, require_ordinary
from scenes.importing.formats.text_lines import coordinates, text_lines

HEADER = 80
TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def read_stl(data: bytes, path: Path) -> ImportedFile:
    """Read an STL file: a part for each solid of a text, named as in the file, or one named after a binary file."""
    count = int.from_bytes(data[HEADER : HEADER + 4], "little") if len(data) >= HEADER + 4 else -1
    size = HEADER + 4 + count * TRIANGLE.itemsize
    if len(data) == size:  # also where the text of the header begins with "solid"
        require_few(count, str(path))
        corners = np.frombuffer(data, TRIANGLE, count, HEADER + 4)["corners"].astype(float)
        return ImportedFile(path, [_part("", corners.reshape(-1, 3), path)], "z")
    if data.lstrip()[:5].lower() == b"solid":
        return ImportedFile(path, _read_text(data, path), "z")
    if count < 0:
        raise InputError(f"{path}: expected a mesh as STL, found a file of {len(data)} bytes")
    raise InputError(
        f"{path}: expected a mesh as STL, which begins with solid or has {size} bytes as it claims {count} triangles, "
        f"found {len(data)} bytes"
    )


def _read_text(data: bytes, path: Path) -> list[ImportedPart]:
    solids: list[tuple[str, array]] = []
    inside, corners, facets = False, 0, 0
    for number, line in text_lines(data):
        words = line.split()
        keyword = words[0].lower() if words else ""
        place = f"{path}: line {number}"
        if keyword in ("solid", "facet", "endsolid") and corners:
            raise InputError(f"{place}: expected endfacet, found {shown(line)}")
        if keyword == "solid":
            inside = True
            solids.append((line[5:].strip(), array("d")))
        elif keyword == "endsolid":
            inside = False
        elif keyword and not inside:
            raise InputError(f"{place}: expected solid, found {shown(line)}")
        elif keyword == "vertex":
            solids[-1][1].extend(coordinates(words[1:], str(path), number))
            corners += 1
        elif keyword == "endfacet":
            if corners != 3:
                raise InputError(f"{place}: expected a facet of three corners, found {corners}")
            corners, facets = 0, facets + 1
            require_few(facets, str(path))
    if inside:
        raise InputError(f"{path}: expected endsolid, found the end of the file")
    return [_part(name, np.frombuffer(corners).reshape(-1, 3), path) for name, corners in solids if corners]


def _part(name: str, corners: Float[np.ndarray, "n 3"], path: Path) -> ImportedPart:
    require_ordinary(corners, str(path))
    mesh = Trimesh(corners, np.arange(len(corners)).reshape(-1, 3), process=False)
    return ImportedPart(name or path.stem, mesh, name)
