"""Damaged and hostile files, each made by one function or named in one table; tests feed them to every reader."""

import base64
import json
import struct
from itertools import pairwise
from typing import Any

import numpy as np

from tests import corpus

CORNERS = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))  # Of one triangle

JSON = {
    "empty": "",
    "not JSON": "{",
    "NaN": '{"a": NaN}',
    "minus infinity": '{"a": -Infinity}',
    "a float that overflows": '{"a": 1e999}',
    "an integer of 5000 digits": '{"a": %s}' % ("9" * 5000),
    "a key twice": '{"a": 1, "a": 2}',
    "lists 100,000 deep": "[" * 100_000,
    "lists 200 deep": "[" * 200 + "]" * 200,
    "UTF-16": "{}".encode("utf-16"),
    "Latin-1": '{"a": "Café"}'.encode("latin-1"),
    "a null character": '{"a": 1}\0',
    "two values": "{} {}",
}
"""Content of files that are no JSON."""

YAML = {
    "an alias": "a: &a [1]\nb: *a\n",
    "doubling aliases": "a: &a [x, x]\n" + "".join(f"{b}: &{b} [*{a}, *{a}]\n" for a, b in pairwise("abcdefghi")),
    "a list in itself": "&a [*a]\n",
    "merged aliases": "a: &a {x: 1}\nb: {<<: *a}\n",
    "lists 20,000 deep": "[" * 20_000,
    "lists 200 deep": "[" * 200 + "]" * 200,
    "a key twice": "a: 1\na: 2\n",
    "a mapping as key": "? {a: b}\n: c\n",
    "an integer that is none": "a: !!int x\n",
    "a date that is none": "a: !!timestamp x\n",
    "an object of Python": "a: !!python/object/apply:os.system [ls]\n",
    "an integer of 5000 digits": f"a: {'9' * 5000}\n",
    "a tab": "a:\n\t- b\n",
    "two documents": "--- a\n--- b\n",
    "a null character": "a: \0\n",
    "UTF-16": "a: b\n".encode("utf-16"),
    "Latin-1": "a: Café\n".encode("latin-1"),
}
"""Content of files that are no YAML, or YAML that we refuse."""


SPECIAL = {name: make for name, (make, _) in corpus.ANY_FILE.items()}
"""Functions that make at a path what must not be read."""


# --- meshes ------------------------------------------------------------------------------------------------


def ply(vertices: Any = CORNERS, faces: Any = ((0, 1, 2),), claimed: int | None = None, binary: bool = True) -> bytes:
    """A PLY file; ``claimed``: the number of vertices that its header claims."""
    head = (
        f"ply\nformat {'binary_little_endian' if binary else 'ascii'} 1.0\nelement vertex {claimed or len(vertices)}\n"
    )
    head += "property double x\nproperty double y\nproperty double z\n"
    head += f"element face {claimed or len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    if not binary:
        rows = [" ".join(map(repr, vertex)) for vertex in vertices] + [
            "3 " + " ".join(map(str, face)) for face in faces
        ]
        return (head + "\n".join(rows) + "\n").encode()
    corners = b"".join(struct.pack("<Biii", 3, *face) for face in faces)
    return head.encode() + np.asarray(vertices, "<f8").tobytes() + corners


def stl(triangles: Any = (CORNERS,), claimed: int | None = None) -> bytes:
    """A binary STL file; ``claimed``: the number of triangles that its header claims."""
    body = b"".join(struct.pack("<12fH", 0, 0, 1, *np.ravel(triangle), 0) for triangle in triangles)
    return bytes(80) + struct.pack("<I", len(triangles) if claimed is None else claimed) + body


def obj(vertices: Any = CORNERS, face: str = "1 2 3", head: str = "") -> bytes:
    """An OBJ file of one face."""
    return (head + "".join(f"v {x} {y} {z}\n" for x, y, z in vertices) + f"f {face}\n").encode()


def off(vertices: Any = CORNERS, face: Any = (0, 1, 2), claimed: int | None = None) -> bytes:
    """An OFF file of one face; ``claimed``: the number of vertices that its header claims."""
    rows = [f"{x} {y} {z}" for x, y, z in vertices] + [f"3 {' '.join(map(str, face))}"]
    return "\n".join(["OFF", f"{claimed or len(vertices)} 1 0", *rows, ""]).encode()


def parts_obj() -> bytes:
    """An OBJ file of two objects and two materials, with a polygon that has a notch, a line and a continued face."""
    return b"""# of a test
v 0 0 0
v 1 0 0
v 0.3 0.3 0
v 0 1 0
o wall
usemtl brick
f 1 2 3 4
usemtl glass
f 1// 2// \\
-1//
o door
g leaf
f 1 2 3
l 1 2
"""


def solids_stl() -> bytes:
    """An STL file of two named solids as text."""
    corners = "".join(f"vertex {x} {y} {z}\n" for x, y, z in CORNERS)
    facet = f"facet normal 0 0 1\nouter loop\n{corners}endloop\nendfacet\n"
    return "".join(f"solid {name}\n{facet}endsolid {name}\n" for name in ("wall", "door")).encode()


INSTANCES = {"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 0}}}}
"""A node of ``gltf`` that shows its triangle at each of the triangle's corners."""


def gltf(**changes: Any) -> dict[str, Any]:
    """The content of a .gltf file of one triangle in one node, with some of its top keys changed."""
    data = np.asarray(CORNERS, "<f4").tobytes() + np.arange(3, dtype="<u4").tobytes()
    content: dict[str, Any] = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "name": "wall"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5125, "count": 3, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 36},
            {"buffer": 0, "byteOffset": 36, "byteLength": 12},
        ],
        "buffers": [{"uri": data_uri(data), "byteLength": 48}],
    }
    return content | changes


def data_uri(data: bytes) -> str:
    """Bytes as glTF files hold them."""
    return "data:application/octet-stream;base64," + base64.b64encode(data).decode()


def gltf_bytes(**changes: Any) -> bytes:
    """A .gltf file of ``gltf``."""
    return json.dumps(gltf(**changes)).encode()


def glb(text: bytes, claimed: int | None = None) -> bytes:
    """A .glb file of one JSON chunk; ``claimed``: the length that its header claims."""
    length = len(text) if claimed is None else claimed
    return b"glTF" + struct.pack("<III4s", 2, 20 + length, length, b"JSON") + text


BILLION = 10**12
NAN, INF = float("nan"), float("inf")


def _accessor(**changes: Any) -> list[dict[str, Any]]:
    first, second = gltf()["accessors"]
    return [first | changes, second]


CHAIN = [{"children": [k + 1]} for k in range(1000)] + [{"mesh": 0}]

MESHES = {
    # file name: content, a part of the sentence
    "nan.ply": (ply([*CORNERS[:2], (NAN, 0, 0)]), r"expected coordinates within .*found \[nan, 0.0, 0.0\] at vertex 2"),
    "unused.ply": (ply([*CORNERS, (INF, 0, 0)]), r"found \[inf, 0.0, 0.0\] at vertex 3"),
    "far.ply": (ply([*CORNERS[:2], (1e30, 0, 0)]), r"found \[1e\+30, 0.0, 0.0\] at vertex 2.*1 of 3 vertices"),
    "outside.ply": (ply(faces=[(0, 1, 3)]), "expected corners with vertex numbers from 0 to 2, found 3 in face 0"),
    "claims.ply": (ply(claimed=BILLION), 'expected "vertex" with 1000000000000 rows in PLY, found fewer'),
    "cut.ply": (ply()[:-5], 'expected "face" with 1 rows in PLY, found fewer'),
    "more.ply": (ply() + b"\0", "expected as many rows as the header of PLY claims, found more"),
    "twice.ply": (ply().replace(b"double z", b"double y"), "expected a header of PLY with .* each name once"),
    "type.ply": (ply().replace(b"double z", b"half z"), "expected a header of PLY, found the line 'property half z'"),
    "fraction.ply": (ply(faces=[(0, 1, 1.5)], binary=False), "expected whole numbers as vertex_indices of PLY"),
    "head.ply": (ply()[:60], "expected end_header in the first 100000 bytes of PLY"),
    "empty.ply": (b"", "expected a mesh as PLY, which begins with ply, found b''"),
    "nan.stl": (stl([[*CORNERS[:2], (NAN, 0, 0)]]), r"found \[nan, 0.0, 0.0\] at vertex 2"),
    "claims.stl": (stl(claimed=4_000_000_000), "as it claims 4000000000 triangles, found 134 bytes"),
    "cut.stl": (stl()[:-5], "which begins with solid or has 134 bytes as it claims 1 triangles, found 129 bytes"),
    "facet.stl": (b"solid wall\nfacet\nvertex 0 0 0\nendsolid", "line 4: expected endfacet, found 'endsolid'"),
    "words.stl": (b"solid wall\nfacet\nvertex 0 0 z\nendsolid", "line 3: expected numbers, found '0 0 z'"),
    "none.stl": (stl([]), "expected a mesh with triangles, found none"),
    "empty.stl": (b"", "expected a mesh as STL, found a file of 0 bytes"),
    "nan.obj": (obj([*CORNERS[:2], ("nan", 0, 0)]), r"found \[nan, 0.0, 0.0\]"),
    "outside.obj": (obj(face="1 2 9"), "line 4: expected vertex numbers from 1 to 3, or from -3 to -1, found 9"),
    "flat.obj": (b"v 0 0\nv 1 0\nv 0 1\nf 1 2 3\n", r"expected vertices of three coordinates, found 2: \[0.0, 0.0\]"),
    "words.obj": (obj(face="a b c"), "line 4: expected vertex numbers, found 'a b c'"),
    "polygon.obj": (obj(face="1 2 3 " * 3334), "expected polygons of at most 10000 corners, found one of 10002"),
    "empty.obj": (b"", "expected a mesh with triangles, found none"),
    "nan.off": (off([*CORNERS[:2], ("nan", 0, 0)]), r"found \[nan, 0.0, 0.0\]"),
    "outside.off": (off(face=(0, 1, 7)), "expected corners with vertex numbers from 0 to 2, found 7 in face 0"),
    "archive.stl": (b"PK\x03\x04" + bytes(100), "expected a mesh as STL, which begins with solid"),
    "parent.gltf": (gltf_bytes(buffers=[{"uri": "../a.bin", "byteLength": 48}]), r"or below, found '\.\./a.bin'"),
    "escaped.gltf": (gltf_bytes(buffers=[{"uri": "%2e%2e/a.bin", "byteLength": 48}]), r"or below, found '\.\./a.bin'"),
    "root.gltf": (gltf_bytes(buffers=[{"uri": "/etc/passwd", "byteLength": 48}]), "or below, found '/etc/passwd'"),
    "pipe.gltf": (gltf_bytes(buffers=[{"uri": "pipe", "byteLength": 48}]), "found a named pipe"),
    "claims.gltf": (gltf_bytes(accessors=_accessor(count=BILLION)), "expected at most 2000000 triangles"),
    "sparse.gltf": (gltf_bytes(accessors=_accessor(sparse={"count": 1})), r"accessors\[0\].* a sparse one"),
    "pair.gltf": (gltf_bytes(accessors=[*_accessor()[:1], _accessor()[1] | {"count": 2}]), "found 2 corners"),
    "more.gltf": (gltf_bytes(accessors=_accessor(count=4)), r"expected 48 bytes in bufferViews\[0\], found 36"),
    "nothing.gltf": (gltf_bytes(nodes=[{"mesh": 7}]), "expected references to parts of the file"),
    "negative.gltf": (gltf_bytes(nodes=[{"mesh": -1}]), r"nodes\[0\].mesh: expected a whole number of at least 0"),
    "circle.gltf": (gltf_bytes(nodes=[{"children": [0]}]), "expected a tree of nodes"),
    "deep.gltf": (gltf_bytes(nodes=CHAIN), "expected nodes at most 100 levels deep"),
    "instances.gltf": (
        gltf_bytes(
            nodes=[{"mesh": 0}] * 10_000,
            scenes=[{"nodes": [*range(10_000)]}],
            meshes=[{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}] * 1000}],
        ),
        "expected at most 2000000 triangles, found 10000000",
    ),
    "matrix.gltf": (gltf_bytes(nodes=[{"mesh": 0, "matrix": [None] * 16}]), r"nodes\[0\]\.matrix\[0\]"),
    "projection.gltf": (gltf_bytes(nodes=[{"mesh": 0, "matrix": [1.0, 0, 0, 1] + [1.0, 0, 0, 0] * 3}]), "affine"),
    "turn.gltf": (gltf_bytes(nodes=[{"mesh": 0, "rotation": [0, 0, 0, 0]}]), "quaternions of a length above 0"),
    "scalars.gltf": (gltf_bytes(accessors=_accessor(type="SCALAR")), r'accessors\[0\]: expected VEC3, found "SCALAR"'),
    "component.gltf": (gltf_bytes(accessors=_accessor(componentType=5)), "expected a componentType of glTF, found 5"),
    "base64.gltf": (gltf_bytes(buffers=[{"uri": "data:;base64,AAA", "byteLength": 48}]), "expected data in Base64"),
    "absent.gltf": (gltf_bytes(buffers=[{"byteLength": 48}]), r"buffers\[0\]: expected data, found none"),
    "old.gltf": (gltf_bytes(asset={"version": "1.0"}, meshes={}), 'expected glTF of version 2, found version "1.0"'),
    "old.glb": (b"glTF" + bytes([1]) + bytes(40), "expected GLB of version 2, found version 1"),
    "draco.gltf": (gltf_bytes(extensionsRequired=["KHR_draco_mesh_compression"]), "KHR_draco_mesh_compression"),
    "mode.gltf": (gltf_bytes(meshes=[{"primitives": [{"attributes": {"POSITION": 0}, "mode": 7}]}]), "found 7"),
    "copies.gltf": (
        gltf_bytes(
            nodes=[{"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 2}}}}],
            accessors=[*gltf()["accessors"], gltf()["accessors"][0] | {"count": 3_000_000}],
        ),
        "expected at most 2000000 triangles, found 3000000",
    ),
    "list.gltf": (b"[]", r"expected a mapping, found \[\]"),
    "empty.gltf": (b"", "malformed JSON"),
    "claims.glb": (glb(b"{}", claimed=4_000_000_000), "complete JSON chunk first, found a damaged file"),
    "cut.glb": (b"glTF\x02", "complete JSON chunk first, found a damaged file"),
}
"""Mesh files that must be refused."""


# --- XML ---------------------------------------------------------------------------------------------------

LAUGHS = '<!DOCTYPE scene [<!ENTITY a "ha">{}]>'.format(
    "".join(f'<!ENTITY {b} "{f"&{a};" * 10}">' for a, b in pairwise("abcdefghi"))
)


def xml(*elements: str, before: str = "") -> str:
    """A Mitsuba scene of the given elements."""
    return f'<?xml version="1.0"?>{before}<scene version="2.1.0">{"".join(elements)}</scene>'


def rectangle(inside: str = "", name: str = "wall") -> str:
    """A shape with a material."""
    return f'<shape type="rectangle" id="{name}">{inside}<bsdf type="diffuse" id="mat-itu_concrete"/></shape>'


def to_world(steps: str) -> str:
    """A transform."""
    return f'<transform name="to_world">{steps}</transform>'


def _mesh(name: str) -> str:
    return f'<shape type="ply" id="wall"><string name="filename" value="{name}"/></shape>'


DOUBLING = '<default name="a0" value="xx"/>' + "".join(
    f'<default name="a{k + 1}" value="$a{k}$a{k}"/>' for k in range(60)
)

XML = {
    "a billion laughs": (xml(rectangle(name="&i;"), before=LAUGHS), "found a DOCTYPE, which is not supported"),
    "an external entity": (
        xml(rectangle(name="&a;"), before='<!DOCTYPE scene [<!ENTITY a SYSTEM "file:///etc/passwd">]>'),
        "found a DOCTYPE",
    ),
    "elements 100,000 deep": ("<scene>" * 100_000, "elements nested more than 50 levels deep"),
    "doubling defaults": (xml(DOUBLING, rectangle()), "at most 10000 characters after replacing"),
    "400 scales": (xml(rectangle(to_world('<scale value="10"/>' * 400))), "expected an invertible affine transform"),
    "a scale of 1e30": (xml(rectangle(to_world('<scale value="1e30"/>'))), "expected coordinates within"),
    "an axis that vanishes": (xml(rectangle(to_world('<rotate x="1e-200" angle="9"/>'))), "expected an axis"),
    "a pipe": (xml(_mesh("pipe.ply")), "found a named pipe"),
    "a mesh elsewhere": (xml(_mesh("/etc/passwd.ply")), "in the folder .* or below, found '/etc/passwd.ply'"),
    "a device": (xml(_mesh("zero.ply")), "found a device"),
    "an unknown encoding": ('<?xml version="1.0" encoding="klingon"?><scene/>', "expected a Mitsuba scene as XML"),
    "a null character": (xml("\0"), "expected a Mitsuba scene as XML"),
    "empty": ("", "expected a Mitsuba scene as XML"),
}
"""Scene files that must be refused, each with a part of the sentence; pipe.ply and zero.ply are beside them."""
