"""Read the meshes in a file of any format with their names, in the file's own unit and axes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from scenes.files.errors import InputError, named
from scenes.files.input_file import read_bytes
from scenes.importing.formats.gltf_arrays import LARGEST_FILE
from scenes.importing.formats.gltf_file import read_gltf
from scenes.importing.formats.mesh_part import ImportedFile, require_few
from scenes.importing.formats.obj_file import read_obj
from scenes.importing.formats.off_file import read_off
from scenes.importing.formats.ply_file import read_ply
from scenes.importing.formats.stl_file import read_stl

READERS: dict[str, Callable[[bytes, Path], ImportedFile]] = {
    ".glb": read_gltf,
    ".gltf": read_gltf,
    ".obj": read_obj,
    ".off": read_off,
    ".ply": read_ply,
    ".stl": read_stl,
}
MESH_SUFFIXES = tuple(READERS)

FLAT = 1e-12  # Largest area, relative to the square of a part's size, that is taken for zero


def read_mesh_file(path: Path) -> ImportedFile:
    """Read the parts of a mesh file, at the places of their nodes, in the file's own unit and axes."""
    suffix = path.suffix.lower()
    if suffix not in READERS:
        known = ", ".join(MESH_SUFFIXES)
        raise InputError(f"{path}: expected a mesh file with one of the suffixes {known}, found {named(path.suffix)}")
    content = READERS[suffix](read_bytes(path, "a mesh", LARGEST_FILE), path)
    parts = sorted((part for part in content.parts if len(part.mesh.faces)), key=lambda part: part.name)
    if not parts:
        also = "".join(f"; {sentence}" for sentence in content.left_out[:1])
        raise InputError(f"{path}: expected a mesh with triangles, found none (is it a point cloud?){also}")
    require_few(sum(len(part.mesh.faces) for part in parts), str(path))
    return _without_flat_parts(replace(content, parts=parts))


def _without_flat_parts(content: ImportedFile) -> ImportedFile:
    """Leave out parts without area, unless all are so. Exporters hide objects by a scale of zero, for example."""
    flat = [part.mesh.area <= FLAT * part.mesh.extents.max() ** 2 for part in content.parts]
    if all(flat) or not any(flat):
        return content
    first = content.parts[flat.index(True)].name
    objects = "1 object was" if sum(flat) == 1 else f"{sum(flat)} objects were"
    sentence = f"{objects} left out because the triangles have no area (the first is {named(first)})"
    parts = [part for part, without in zip(content.parts, flat, strict=True) if not without]
    return replace(content, parts=parts, left_out=(*content.left_out, sentence))
