"""Check the header of a glTF file before trimesh reads it: sizes, references, and unsupported features."""

from __future__ import annotations

import struct
from typing import Annotated

from msgspec import Meta, Struct

from scenes.files.errors import InputError
from scenes.files.json_file import parse_json
from scenes.files.schema import conform

Count = Annotated[int, Meta(ge=0)]

COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
WIDEST = 4
"""Bytes of the widest component."""
DEEPEST = 100
"""Most levels of nodes. The reader's time grows with the square of them."""


class Accessor(Struct, rename="camel"):
    count: Count
    type: str
    buffer_view: Count | None = None
    sparse: dict | None = None


class View(Struct, rename="camel"):
    byte_length: Count


class Primitive(Struct, rename="camel"):
    attributes: dict[str, Count]
    indices: Count | None = None
    mode: Count = 4


class Mesh(Struct):
    primitives: list[Primitive]


class Node(Struct):
    children: list[Count] = []
    mesh: Count | None = None


class Root(Struct):
    nodes: list[Count] = []


class Header(Struct, rename="camel"):
    """The parts of a glTF file's JSON that are checked (glTF 2.0 specification, section 5)."""

    accessors: list[Accessor] = []
    buffer_views: list[View] = []
    meshes: list[Mesh] = []
    nodes: list[Node] = []
    scenes: list[Root] = []
    scene: Count = 0


def check_gltf(data: bytes, source: str, most_bytes: int, most_triangles: int) -> None:
    """Refuse a glTF file whose header claims too much, or that has unsupported features.

    Args:
        data: content of a .glb or .gltf file.
        source: the start of every message: the file's name.
        most_bytes: largest size of all its arrays together.
        most_triangles: largest number of triangles of all its nodes together.

    Raises:
        InputError: the JSON is damaged, a reference leads nowhere, the nodes form a loop or are nested too deep,
            geometry is compressed or sparse, or the arrays or triangles exceed their limits.
    """
    header = conform(parse_json(_json_of(data, source), source, "a glTF header"), Header, source)
    size = sum(view.byte_length for view in header.buffer_views)
    size += sum(WIDEST * each.count * COMPONENTS.get(each.type, 16) for each in header.accessors)
    if size > most_bytes:
        raise InputError(f"{source}: expected arrays of at most {most_bytes / 1e6:g} MB, found {size / 1e6:.4g} MB")
    try:
        triangles = [sum(_corners(part, header, source) // 3 for part in mesh.primitives) for mesh in header.meshes]
        drawn = sum(triangles[node.mesh] for node in header.nodes if node.mesh is not None)
        _check_depth(header, source)
    except IndexError:
        raise InputError(f"{source}: expected references to parts of the file, found one that leads nowhere") from None
    total = max(drawn, sum(triangles))
    if total > most_triangles:
        raise InputError(f"{source}: expected at most {most_triangles} triangles, found {total}")


def _json_of(data: bytes, source: str) -> str:
    """Return the JSON of a .gltf file, or of the first chunk of a .glb file."""
    if data[:4] == b"glTF":
        try:
            length, kind = struct.unpack_from("<I4s", data, 12)
        except struct.error:
            length, kind = 0, b""
        if kind != b"JSON" or 20 + length > len(data):
            raise InputError(f"{source}: expected a GLB file with a complete JSON chunk first, found a damaged file")
        data = data[20 : 20 + length]
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(f"{source}: expected a glTF header as UTF-8, found another encoding") from None


def _corners(part: Primitive, header: Header, source: str) -> int:
    """Return the number of vertices of a primitive, or of corners of its triangles, whichever is larger."""
    used = [part.attributes["POSITION"]] if "POSITION" in part.attributes else []
    used += [] if part.indices is None else [part.indices]
    for index in used:
        accessor = header.accessors[index]
        if accessor.buffer_view is None or accessor.sparse is not None:
            raise InputError(
                f"{source}: expected plain geometry, found compressed or sparse geometry in accessors[{index}]"
            )
    return max((header.accessors[index].count for index in used), default=0)


def _check_depth(header: Header, source: str) -> None:
    """Refuse nodes that are nested too deep or that form a loop."""
    level = header.scenes[header.scene].nodes if header.scenes else []
    visited = len(level)
    for _ in range(DEEPEST):
        level = [child for node in level for child in header.nodes[node].children]
        visited += len(level)
        if visited > len(header.nodes):
            raise InputError(f"{source}: expected a tree of nodes, found a node that occurs twice")
        if not level:
            return
    raise InputError(f"{source}: expected nodes at most {DEEPEST} levels deep, found more")
