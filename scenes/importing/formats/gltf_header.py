"""Read the JSON of a glTF file, and refuse what we do not support or what claims too much, before any array is read."""

from __future__ import annotations

import struct
from collections.abc import Iterable, Sequence
from typing import Annotated, Any, TypeVar

from msgspec import Meta, Struct

from scenes.files.errors import InputError, named
from scenes.files.json_yaml_xml import parse_json
from scenes.files.schema import Count, conform
from scenes.importing.formats.mesh_part import require_few

T = TypeVar("T")

Vector3 = tuple[float, float, float]
Vector4 = tuple[float, float, float, float]
Matrix4 = Annotated[list[float], Meta(min_length=16, max_length=16)]

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


class Primitive(Struct):
    attributes: dict[str, Count]
    indices: Count | None = None
    mode: Annotated[int, Meta(ge=0, le=FAN)] = TRIANGLES
    material: Count | None = None
    targets: list[dict[str, Count]] = []


class Mesh(Struct):
    primitives: list[Primitive]
    name: str = ""
    weights: list[float] = []


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
    extensions: dict[str, Any] = {}


class Root(Struct):
    nodes: list[Count] = []


class Asset(Struct, frozen=True):
    version: str | float = "2.0"


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
    extensions_used: list[str] = []
    extensions_required: list[str] = []


def read_header(data: bytes, source: str) -> tuple[Header, bytes | None]:
    """Read the JSON of a .gltf file, or of a .glb file with the binary chunk beside it."""
    text, binary = _chunks(data, source)
    value = parse_json(text, source, "a glTF header")
    version = str(conform(value, Version, source).asset.version)
    if version.partition(".")[0] != "2":
        raise InputError(f"{source}: expected glTF of version 2, found version {named(version)}")
    header = conform(value, Header, source)
    for name in unknown(header.extensions_required):
        way = "it uncompressed" if name in COMPRESSION else "the file without it"
        raise InputError(
            f"{source}: the file requires the extension {named(name)}, which is not supported; export {way}"
        )
    _require_few_drawn(header, source)
    return header, binary


def unknown(extensions: list[str]) -> list[str]:
    """Those of some extensions that may change triangles in a way that we do not know."""
    return [name for name in extensions if name not in OBEYED and not name.startswith(IRRELEVANT)]


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


def _require_few_drawn(header: Header, source: str) -> None:
    """Refuse too many triangles, by the counts that the file claims, before any array is read."""

    def largest(accessors: Iterable[int]) -> int:
        return max((pick(header.accessors, index, source, "accessors").count for index in accessors), default=0)

    triangles = []
    for mesh in header.meshes:
        corners = 0
        for part in mesh.primitives:
            used = [each for each in (part.attributes.get("POSITION"), part.indices) if each is not None]
            # Each further corner of a fan makes a triangle, and points and lines make none.
            corners += 0 if part.mode in POINTS_AND_LINES else largest(used) * (3 if part.mode == FAN else 1)
        triangles.append(corners // 3)
    drawn = [
        pick(triangles, node.mesh, source, "meshes") * (largest(instances(node, source).values()) or 1)
        for node in header.nodes
        if node.mesh is not None
    ]
    require_few(max(sum(drawn), sum(triangles)), source)
