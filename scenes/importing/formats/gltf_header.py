"""Read the JSON of a glTF file, and refuse what we do not support or what claims too much, before any array is read."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import Annotated, Any, TypeVar

from msgspec import Meta, Struct

from scenes.files.errors import InputError, named
from scenes.files.json_yaml_xml import parse_json
from scenes.files.schema import conform

T = TypeVar("T")

Count = Annotated[int, Meta(ge=0)]
Vector3 = tuple[float, float, float]
Vector4 = tuple[float, float, float, float]
Matrix4 = Annotated[list[float], Meta(min_length=16, max_length=16)]
Extensions = dict[str, Any]

COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
WIDEST = 4  # Bytes of the widest component
DEEPEST = 100  # Most levels of nodes
POINTS_AND_LINES, TRIANGLES, STRIP, FAN = (0, 1, 2, 3), 4, 5, 6  # Modes of primitives

INSTANCING = "EXT_mesh_gpu_instancing"
COMPRESSION = ("KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression")
OBEYED = ("KHR_mesh_quantization", INSTANCING)
IRRELEVANT = (
    *("KHR_materials_", "KHR_texture_", "EXT_texture_", "MSFT_texture_", "KHR_lights_", "EXT_lights_", "KHR_xmp"),
    *("KHR_technique", "KHR_animation_pointer", "EXT_mesh_features", "EXT_structural_metadata"),
    *("EXT_instance_features", "CESIUM_primitive_outline", "MSFT_lod"),
)
"""Beginnings of the names of extensions that do not change triangles."""


class Accessor(Struct, rename="camel"):
    count: Count
    type: str
    component_type: Count
    buffer_view: Count | None = None
    byte_offset: Count = 0
    normalized: bool = False
    sparse: Any = None


class View(Struct, rename="camel"):
    byte_length: Count
    buffer: Count = 0
    byte_offset: Count = 0
    byte_stride: Count | None = None


class Buffer(Struct, rename="camel"):
    byte_length: Count
    uri: str | None = None
    extensions: Extensions = {}


class Primitive(Struct):
    attributes: dict[str, Count]
    indices: Count | None = None
    mode: Annotated[int, Meta(ge=0, le=FAN)] = TRIANGLES
    material: Count | None = None
    targets: list[dict[str, Count]] = []
    extensions: Extensions = {}


class Mesh(Struct):
    primitives: list[Primitive]
    name: str = ""
    weights: list[float] = []
    extensions: Extensions = {}


class Material(Struct):
    name: str = ""


class Node(Struct):
    children: list[Count] = []
    mesh: Count | None = None
    skin: Count | None = None
    name: str = ""
    matrix: Matrix4 | None = None
    translation: Vector3 = (0, 0, 0)
    rotation: Vector4 = (0, 0, 0, 1)
    scale: Vector3 = (1, 1, 1)
    weights: list[float] = []
    extensions: Extensions = {}


class Root(Struct):
    nodes: list[Count] = []


class Asset(Struct, frozen=True):
    version: str | float = "2.0"
    generator: str = ""


class Version(Struct):
    asset: Asset = Asset()


class Instances(Struct):
    """The extension EXT_mesh_gpu_instancing of a node."""

    attributes: dict[str, Count]


class Header(Struct, rename="camel"):
    """The parts of a glTF file's JSON that geometry depends on (glTF 2.0 specification, section 5)."""

    asset: Asset = Asset()
    accessors: list[Accessor] = []
    buffer_views: list[View] = []
    buffers: list[Buffer] = []
    meshes: list[Mesh] = []
    materials: list[Material] = []
    nodes: list[Node] = []
    scenes: list[Root] = []
    scene: Count = 0
    animations: list[Any] = []
    extensions_required: list[str] = []


def read_header(data: bytes, source: str) -> tuple[Header, bytes | None]:
    """Read the JSON of a .gltf file, or of a .glb file with the binary chunk beside it."""
    text, binary = _chunks(data, source)
    value = parse_json(text, source, "a glTF header")
    version = str(conform(value, Version, source).asset.version)
    if version.partition(".")[0] != "2":
        raise InputError(f"{source}: expected glTF of version 2, found version {named(version)}")
    header = conform(value, Header, source)
    for name in header.extensions_required:
        if name not in OBEYED and not name.startswith(IRRELEVANT):
            way = "it uncompressed" if name in COMPRESSION else "the file without it"
            raise InputError(
                f"{source}: the file requires the extension {named(name)}, which is not supported; export {way}"
            )
    return header, binary


def check_sizes(header: Header, source: str, most_bytes: int, most_triangles: int) -> None:
    """Refuse a file whose arrays or triangles are too large."""
    size = sum(view.byte_length for view in header.buffer_views)
    size += sum(WIDEST * each.count * COMPONENTS.get(each.type, 16) for each in header.accessors)
    if size > most_bytes:
        raise InputError(f"{source}: expected arrays of at most {most_bytes / 1e6:g} MB, found {size / 1e6:.4g} MB")
    triangles = [sum(_most_triangles(part, header, source) for part in mesh.primitives) for mesh in header.meshes]
    drawn = 0
    for node in header.nodes:
        if node.mesh is not None:
            drawn += pick(triangles, node.mesh, source, "meshes") * _most_instances(node, header, source)
    total = max(drawn, sum(triangles))
    if total > most_triangles:
        raise InputError(f"{source}: expected at most {most_triangles} triangles, found {total}")


def pick(things: Sequence[T], index: int, source: str, key: str) -> T:
    """Return one of several things that a file refers to by its number. Raise an InputError if there is none."""
    if index >= len(things):
        raise InputError(
            f"{source}: expected references to parts of the file, found one to {key}[{index}], which does not exist"
        )
    return things[index]


def instances(node: Node, source: str) -> dict[str, int]:
    """Return the accessors of the places at which a node's mesh is repeated, by name; none if it is not repeated."""
    if INSTANCING not in node.extensions:
        return {}
    return conform(node.extensions[INSTANCING], Instances, f"{source}: {INSTANCING}").attributes


def node_name(header: Header, index: int) -> str:
    """Return the name of a node or, if it has none, of its mesh or a numbered one."""
    node = header.nodes[index]
    mesh = header.meshes[node.mesh].name if node.mesh is not None and node.mesh < len(header.meshes) else ""
    return node.name or mesh or f"node_{index}"


def _chunks(data: bytes, source: str) -> tuple[str, bytes | None]:
    """Return the JSON of a .gltf file, or the first two chunks of a .glb file."""
    binary = None
    if data[:4] == b"glTF":
        try:
            version, _, length, kind = struct.unpack_from("<III4s", data, 4)
        except struct.error:
            version, length, kind = 2, 0, b""
        if version != 2:
            raise InputError(f"{source}: expected GLB of version 2, found version {version}")
        if kind != b"JSON" or 20 + length > len(data):
            raise InputError(f"{source}: expected a GLB file with a complete JSON chunk first, found a damaged file")
        rest = data[20 + length :]
        if rest[4:8] == b"BIN\0":
            binary = rest[8 : 8 + int.from_bytes(rest[:4], "little")]
        data = data[20 : 20 + length]
    try:
        return data.decode("utf-8-sig"), binary
    except UnicodeDecodeError:
        raise InputError(f"{source}: expected a glTF header as UTF-8, found another encoding") from None


def _most_triangles(part: Primitive, header: Header, source: str) -> int:
    """Return a number of triangles that a primitive cannot exceed."""
    if part.mode in POINTS_AND_LINES:
        return 0
    used = [part.attributes["POSITION"]] if "POSITION" in part.attributes else []
    used += [] if part.indices is None else [part.indices]
    corners = max((pick(header.accessors, index, source, "accessors").count for index in used), default=0)
    return corners // 3 if part.mode == TRIANGLES else corners


def _most_instances(node: Node, header: Header, source: str) -> int:
    counts = [pick(header.accessors, index, source, "accessors").count for index in instances(node, source).values()]
    return max(counts, default=1)
