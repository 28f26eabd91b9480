"""glTF: triangles and fans, quantised arrays, extensions, transforms, names, and what is refused or left out."""

import base64
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from scenes.files.errors import InputError
from scenes.importing.formats.gltf_file import read_gltf
from scenes.scene.shapes import box

SQUARE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
PATH = Path("room.glb")

CODES = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "f4": 5126}


class GltfBuilder:
    """A glTF file: arrays are added first, and then the header names them by their numbers."""

    def __init__(self) -> None:
        self.data, self.views, self.accessors = b"", [], []

    def array(self, values: Any, kind: str = "f4", gap: int = 0, **more: Any) -> int:
        """Add numbers, with gaps between the rows if you like; return the number of their accessor."""
        rows = np.asarray(values, f"<{kind}")
        raw = b"".join(row.tobytes() + b"\0" * gap for row in rows)
        strided = {"byteStride": rows[0].nbytes + gap} if gap else {}
        self.views.append({"buffer": 0, "byteOffset": len(self.data), "byteLength": len(raw), **strided})
        shape = "SCALAR" if rows.ndim == 1 else f"VEC{rows.shape[-1]}"
        entry = {"bufferView": len(self.accessors), "componentType": CODES[kind], "count": len(rows), "type": shape}
        self.accessors.append(entry | more)
        self.data += raw + b"\0" * (-len(raw) % 4)
        return len(self.accessors) - 1

    def box(self, low: Any, high: Any, **more: Any) -> dict[str, Any]:
        """Add a closed box; return its primitive."""
        mesh = box(low, high)
        corners = self.array(mesh.faces.ravel(), "u2")
        return {"attributes": {"POSITION": self.array(mesh.vertices)}, "indices": corners, **more}

    def header(self, **keys: Any) -> dict[str, Any]:
        """The header with the keys given; by default all nodes are roots of the only scene."""
        scenes = {"scenes": [{"nodes": list(range(len(keys.get("nodes", []))))}], "scene": 0}
        buffers = {"bufferViews": self.views, "buffers": [{"byteLength": len(self.data)}]}
        asset = {"version": "2.0", "generator": "a test"}
        return {"asset": asset, **scenes, "accessors": self.accessors, **buffers, **keys}

    def gltf(self, **keys: Any) -> bytes:
        uri = "data:application/octet-stream;base64," + base64.b64encode(self.data).decode()
        return json.dumps(self.header(**keys) | {"buffers": [{"byteLength": len(self.data), "uri": uri}]}).encode()

    def glb(self, **keys: Any) -> bytes:
        text = json.dumps(self.header(**keys)).encode()
        text += b" " * (-len(text) % 4)
        head = struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(self.data))
        chunk = struct.pack("<I4s", len(text), b"JSON") + text
        return head + chunk + struct.pack("<I4s", len(self.data), b"BIN\0") + self.data


@pytest.fixture
def make():
    return GltfBuilder()


@pytest.fixture
def wall(make):
    return {"attributes": {"POSITION": make.array(SQUARE)}, "mode": 6}


def one(data: bytes):
    (part,) = read_gltf(data, PATH).parts
    return part.mesh


@pytest.mark.parametrize("container", ["gltf", "glb"])
@pytest.mark.parametrize("indexed", [True, False])
@pytest.mark.parametrize(("mode", "order"), [(4, [0, 1, 2, 0, 2, 3]), (6, [0, 1, 2, 3])])
def test_triangles_and_fans(make, mode, order, indexed, container):
    corners = SQUARE if indexed else [SQUARE[k] for k in order]
    primitive = {"attributes": {"POSITION": make.array(corners)}, "mode": mode}
    primitive |= {"indices": make.array(order, "u1")} if indexed else {}
    mesh = one(getattr(make, container)(meshes=[{"primitives": [primitive]}], nodes=[{"mesh": 0}]))
    assert mesh.area == pytest.approx(1)
    np.testing.assert_allclose(mesh.face_normals, [[0, 0, 1]] * 2, atol=1e-12)


def test_points_and_lines_are_named(make, wall):
    others = [{"attributes": {"POSITION": 0}, "mode": mode} for mode in (0, 1, 2, 3)]
    meshes = [{"primitives": [wall, *others]}, {"primitives": [wall]}, {"primitives": others[:1]}]
    nodes = [{"mesh": k, "name": name} for k, name in enumerate(["fence", "wall", "scan"])]
    file = read_gltf(make.glb(meshes=meshes, nodes=nodes), PATH)
    assert [part.name for part in file.parts] == ["fence", "wall"]
    assert len(file.left_out) == 1 and '"fence", "scan"' in file.left_out[0]


@pytest.mark.parametrize(
    ("kind", "normalized", "scale"),
    [("i1", True, 127), ("u1", True, 255), ("i2", True, 32767), ("u2", True, 65535), ("i2", False, 1)],
)
@pytest.mark.parametrize("gap", [0, 1])
def test_quantised_positions(make, kind, normalized, scale, gap):
    """Exporters pad the rows of such arrays to multiples of four bytes."""
    corners = make.array(np.multiply(SQUARE, scale), kind, gap, normalized=normalized)
    meshes = [{"primitives": [{"attributes": {"POSITION": corners}, "mode": 6}]}]
    required = {"extensionsRequired": ["KHR_mesh_quantization"]}
    mesh = one(make.glb(meshes=meshes, nodes=[{"mesh": 0, "scale": [3, 2, 1]}], **required))
    np.testing.assert_allclose(mesh.bounds, [[0, 0, 0], [3, 2, 0]], atol=1e-12)
    assert mesh.area == pytest.approx(6)


def test_the_least_normalised_integer_is_not_below_minus_one(make):
    corners = make.array([(-128, 0, 0), (127, 0, 0), (0, 127, 0)], "i1", normalized=True)
    mesh = one(make.glb(meshes=[{"primitives": [{"attributes": {"POSITION": corners}}]}], nodes=[{"mesh": 0}]))
    np.testing.assert_allclose(mesh.bounds, [[-1, 0, 0], [1, 1, 0]])


RARE = [
    ({"mode": 5}, {}, "strips"),
    ({"targets": [{"POSITION": 0}]}, {"weights": [0.5]}, "morph"),
    ({}, {"skin": 0}, "skin"),
]


@pytest.mark.parametrize(("primitive", "node", "word"), RARE)
def test_what_is_rare_is_refused(make, wall, primitive, node, word):
    data = make.glb(meshes=[{"primitives": [wall | primitive]}], nodes=[{"mesh": 0, "name": "statue"} | node])
    with pytest.raises(InputError, match=f"room.glb: 'statue': .* {word}"):
        read_gltf(data, PATH)


def test_morph_targets_without_weights_and_animations_are_read_at_rest(make):
    still = {"attributes": {"POSITION": make.array(SQUARE)}, "targets": [{"POSITION": 0}], "mode": 6}
    meshes = [{"primitives": [still], "weights": [0.0]}]
    file = read_gltf(make.glb(meshes=meshes, nodes=[{"mesh": 0}], animations=[{"channels": [], "samplers": []}]), PATH)
    assert file.parts[0].mesh.area == pytest.approx(1) and "animations" in file.left_out[0]


TURN = Rotation.from_euler("xyz", [30, 40, 50], degrees=True)


def transform(scale=(1, 1, 1), turn=TURN, move=(7, -8, 9)) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, :3] = turn.as_matrix() * scale
    matrix[:3, 3] = move
    return matrix


def as_node(how: str, scale=(1, 1, 1), turn=TURN, move=(7, -8, 9)) -> dict:
    if how == "matrix":
        return {"matrix": transform(scale, turn, move).T.ravel().tolist()}
    return {"translation": list(move), "rotation": turn.as_quat().tolist(), "scale": list(scale)}


@pytest.mark.parametrize("how", ["matrix", "parts"])
@pytest.mark.parametrize("scale", [(1, 2, 3), (-1, 2, 3), (-1, -2, 3), (-1, -2, -3)])
def test_nested_turned_and_mirrored_nodes_keep_their_outer_side(make, how, scale):
    """A mesh of two nodes; one is three levels deep, and one of those above is mirrored."""
    nodes = [
        {"mesh": 0, "name": "alone"},
        as_node(how, (-2, 2, 2)) | {"children": [2]},
        as_node(how, (1, 1, 1), move=(0, 5, 0)) | {"children": [3]},
        as_node(how, scale, move=(1, 0, 0)) | {"mesh": 0, "name": "deep"},
    ]
    cube = {"primitives": [make.box((0, 0, 0), (1, 1, 1))]}
    file = read_gltf(make.glb(meshes=[cube], nodes=nodes, scenes=[{"nodes": [1, 0]}]), PATH)
    alone, mesh = (part.mesh for part in file.parts)
    assert alone.volume == pytest.approx(1) and mesh.volume == pytest.approx(8 * 6)
    matrix = transform((-2, 2, 2)) @ transform(move=(0, 5, 0)) @ transform(scale, move=(1, 0, 0))
    corners = box((0, 0, 0), (1, 1, 1)).vertices @ matrix[:3, :3].T + matrix[:3, 3]
    np.testing.assert_allclose(mesh.bounds, [corners.min(axis=0), corners.max(axis=0)], atol=1e-5)
    outwards = mesh.triangles_center - mesh.vertices.mean(axis=0)
    assert (np.einsum("fi,fi->f", outwards, mesh.face_normals) > 0).all()


def test_instances(make):
    """Four pillars of one node: one moved, one turned, one scaled, one mirrored."""
    instances = {
        "TRANSLATION": make.array([(0, 0, 0), (5, 0, 0), (0, 5, 0), (5, 5, 0)]),
        "ROTATION": make.array([(0, 0, 0, 127), (0, 0, 90, 90), (0, 0, 0, 127), (0, 0, 0, 127)], "i1", normalized=True),
        "SCALE": make.array([(1, 1, 1), (1, 1, 1), (1, 1, 3), (-1, 1, 1)]),
    }
    node = {"mesh": 0, "name": "pillar", "translation": [100, 0, 0]}
    node["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": instances}}
    meshes = [{"primitives": [make.box((0, 0, 0), (1, 2, 1))]}]
    data = make.glb(meshes=meshes, nodes=[node], extensionsRequired=["EXT_mesh_gpu_instancing"])
    pillars = one(data).split(only_watertight=True)
    bounds = sorted(tuple(np.round(each.bounds, 3).ravel()) for each in pillars)
    assert bounds == [
        (100, 0, 0, 101, 2, 1),
        (100, 5, 0, 101, 7, 3),
        (103, 0, 0, 105, 1, 1),
        (104, 5, 0, 105, 7, 1),
    ]
    assert [round(each.volume, 6) for each in pillars] == [2, 2, 6, 2]
    assert read_gltf(data, PATH).left_out == ()


def test_names_of_parts(make, wall):
    meshes = [
        {"primitives": [wall | {"material": 0}, wall | {"material": 1}, wall | {"material": 0}, wall]},
        {"primitives": [wall | {"material": 2}], "name": "Roof.mesh"},
        {"primitives": [wall]},
    ]
    nodes = [{"mesh": 0, "name": "Facade"}, {"mesh": 1}, {"mesh": 2}, {"mesh": 1, "name": "Tower/roof"}]
    data = make.glb(meshes=meshes, nodes=nodes, materials=[{"name": "brick"}, {"name": "glass.001"}, {}])
    file = read_gltf(data, PATH)
    assert [(part.name, part.node, part.material, part.mesh.area) for part in file.parts] == [
        ("Facade/brick", "Facade", "brick", 2),
        ("Facade/glass.001", "Facade", "glass.001", 1),
        ("Facade", "Facade", None, 1),
        ("Roof.mesh", "Roof.mesh", "material_2", 1),
        ("node_2", "node_2", None, 1),
        ("Tower/roof", "Tower/roof", "material_2", 1),
    ]


def test_other_scenes_and_nodes_are_named(make, wall):
    nodes = [
        *({"mesh": 0, "name": name} for name in ("room", "shed", "lost")),
        {"name": "camera"},
        {"name": "circle", "children": [5]},
        {"mesh": 0, "name": "in a circle", "children": [4]},
    ]
    meshes = [{"primitives": [wall]}, {"primitives": [wall], "name": "spare"}]
    file = read_gltf(make.glb(meshes=meshes, nodes=nodes, scenes=[{"nodes": [1]}, {"nodes": [0, 3]}], scene=1), PATH)
    assert [part.name for part in file.parts] == ["room"]
    outside, unused = file.left_out
    assert outside.endswith('"shed", "lost", "in a circle"') and unused.endswith('"spare"')


def test_without_scenes_all_nodes_are_read(make, wall):
    nodes = [{"children": [1], "translation": [0, 0, 1]}, {"mesh": 0, "name": "wall"}]
    header = make.header(meshes=[{"primitives": [wall]}], nodes=nodes)
    del header["scenes"], header["scene"]
    header["buffers"][0]["uri"] = json.loads(make.gltf())["buffers"][0]["uri"]
    assert one(json.dumps(header).encode()).bounds[0, 2] == 1


def test_unknown_extensions_that_are_not_required_are_named(make, wall):
    used = ["KHR_materials_variants", "ACME_bend", "EXT_mesh_gpu_instancing", "KHR_node_visibility"]
    file = read_gltf(make.glb(meshes=[{"primitives": [wall]}], nodes=[{"mesh": 0}], extensionsUsed=used), PATH)
    (sentence,) = file.left_out
    assert len(file.parts) == 1 and sentence.endswith(': "ACME_bend", "KHR_node_visibility"')
