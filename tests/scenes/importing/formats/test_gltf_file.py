"""glTF: triangles and fans, quantised arrays, extensions, transforms, names, and what is refused or left out."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from scenes.files.errors import InputError
from scenes.importing.formats.gltf_file import read_gltf
from scenes.scene.shapes import box
from tests.scenes.importing.formats.gltf_builder import GltfBuilder

CUBE = box((0, 0, 0), (1, 1, 1))
SQUARE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
PATH = Path("room.glb")


@pytest.fixture
def make():
    return GltfBuilder()


def parts(data: bytes) -> dict[str, tuple]:
    file = read_gltf(data, PATH)
    assert len({part.name for part in file.parts}) == len(file.parts)
    return {part.name: part for part in file.parts}


def one(data: bytes):
    (part,) = read_gltf(data, PATH).parts
    return part.mesh


# --- primitives and arrays -----------------------------------------------------------------------------------


@pytest.mark.parametrize("container", ["gltf", "glb"])
@pytest.mark.parametrize("indexed", [True, False])
@pytest.mark.parametrize(
    ("mode", "corners", "order"),
    [(4, SQUARE, [0, 1, 2, 0, 2, 3]), (6, SQUARE, [0, 1, 2, 3])],
)
def test_triangles_and_fans(make, mode, corners, order, indexed, container):
    if indexed:
        primitive = {"attributes": {"POSITION": make.array(corners)}, "indices": make.array(order, "u1"), "mode": mode}
    else:
        primitive = {"attributes": {"POSITION": make.array([corners[k] for k in order])}, "mode": mode}
    mesh = one(getattr(make, container)(meshes=[{"primitives": [primitive]}], nodes=[{"mesh": 0}]))
    assert mesh.area == pytest.approx(1)
    np.testing.assert_allclose(mesh.face_normals, [[0, 0, 1]] * 2, atol=1e-12)


def test_points_and_lines_are_named(make):
    surface = {"attributes": {"POSITION": make.array(SQUARE)}, "mode": 6}
    others = [{"attributes": {"POSITION": 0}, "mode": mode} for mode in (0, 1, 2, 3)]
    meshes = [{"primitives": [surface, *others]}, {"primitives": [surface]}, {"primitives": others[:1]}]
    nodes = [{"mesh": k, "name": name} for k, name in enumerate(["fence", "wall", "scan"])]
    file = read_gltf(make.glb(meshes=meshes, nodes=nodes), PATH)
    assert [part.name for part in file.parts] == ["fence", "wall"]
    assert file.left_out == ('points and lines were left out, in "fence", "scan"',)


@pytest.mark.parametrize(
    ("kind", "normalized", "scale"),
    [
        ("i1", True, 127),
        ("u1", True, 255),
        ("i2", True, 32767),
        ("u2", True, 65535),
        ("i2", False, 1),
        ("u1", False, 1),
    ],
)
@pytest.mark.parametrize("gap", [0, 1])
def test_quantised_positions(make, kind, normalized, scale, gap):
    """Exporters pad the rows of such arrays to multiples of four bytes."""
    corners = make.array(np.multiply(SQUARE, scale), kind, gap, normalized=normalized)
    mesh = one(
        make.glb(
            meshes=[{"primitives": [{"attributes": {"POSITION": corners}, "mode": 6}]}],
            nodes=[{"mesh": 0, "scale": [3, 2, 1]}],
            extensionsRequired=["KHR_mesh_quantization"],
        )
    )
    np.testing.assert_allclose(mesh.bounds, [[0, 0, 0], [3, 2, 0]], atol=1e-12)
    assert mesh.area == pytest.approx(6)


def test_the_least_normalised_integer_is_not_below_minus_one(make):
    corners = make.array([(-128, 0, 0), (127, 0, 0), (0, 127, 0)], "i1", normalized=True)
    mesh = one(make.glb(meshes=[{"primitives": [{"attributes": {"POSITION": corners}}]}], nodes=[{"mesh": 0}]))
    np.testing.assert_allclose(mesh.bounds, [[-1, 0, 0], [1, 1, 0]])


@pytest.mark.parametrize(
    ("primitive", "node", "sentence"),
    [
        ({"mode": 5}, {}, "room.glb: 'statue': .* found triangles in strips; .* export again"),
        ({"targets": [{"POSITION": 1}]}, {"weights": [0.5]}, "found a mesh with morph targets; .* export again"),
        ({}, {"skin": 0}, "found a mesh with a skin; .* export again"),
        ({"indices": 2}, {}, r"room.glb: accessors\[2\]: expected a plain array, found a sparse one; export without"),
    ],
)
def test_what_is_rare_is_refused_with_a_way_out(make, primitive, node, sentence):
    position, _, indices = make.array(SQUARE), make.array(SQUARE), make.array([0, 1, 2], "u1")
    make.accessors[indices]["sparse"] = {"count": 1}
    mesh = {"primitives": [{"attributes": {"POSITION": position}, "mode": 6} | primitive]}
    with pytest.raises(InputError, match=sentence):
        read_gltf(make.glb(meshes=[mesh], nodes=[{"mesh": 0, "name": "statue"} | node]), PATH)


def test_morph_targets_without_weights_and_animations_are_read_at_rest(make):
    still = {"attributes": {"POSITION": make.array(SQUARE)}, "targets": [{"POSITION": 0}], "mode": 6}
    meshes = [{"primitives": [still], "weights": [0.0]}]
    file = read_gltf(make.glb(meshes=meshes, nodes=[{"mesh": 0}], animations=[{"channels": [], "samplers": []}]), PATH)
    assert file.parts[0].mesh.area == pytest.approx(1)
    assert file.left_out == ("animations were left out: 1 in the file; the pose at rest was read",)


# --- transforms ----------------------------------------------------------------------------------------------

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
def test_turned_and_mirrored_nodes_keep_their_outer_side(make, how, scale):
    mesh = one(
        make.glb(meshes=[{"primitives": [make.box((0, 0, 0), (1, 1, 1))]}], nodes=[as_node(how, scale) | {"mesh": 0}])
    )
    assert mesh.volume == pytest.approx(6) and mesh.area == pytest.approx(22)
    expected = CUBE.vertices @ transform(scale)[:3, :3].T + [7, -8, 9]
    np.testing.assert_allclose(mesh.bounds, [expected.min(axis=0), expected.max(axis=0)], atol=1e-5)
    outwards = mesh.triangles_center - mesh.vertices.mean(axis=0)
    assert (np.einsum("fi,fi->f", outwards, mesh.face_normals) > 0).all()


@pytest.mark.parametrize("how", ["matrix", "parts"])
def test_transforms_of_nested_nodes(make, how):
    """A mesh of two nodes; one is three levels deep, mirrored twice, so not mirrored."""
    nodes = [
        {"mesh": 0, "name": "alone"},
        as_node(how, (-2, 2, 2)) | {"children": [2]},
        as_node(how, (1, 1, 1), move=(0, 5, 0)) | {"children": [3]},
        as_node(how, (1, -1, 1), move=(1, 0, 0)) | {"mesh": 0, "name": "deep"},
    ]
    found = parts(
        make.glb(meshes=[{"primitives": [make.box((0, 0, 0), (1, 1, 1))]}], nodes=nodes, scenes=[{"nodes": [1, 0]}])
    )
    matrix = transform((-2, 2, 2)) @ transform(move=(0, 5, 0)) @ transform((1, -1, 1), move=(1, 0, 0))
    expected = CUBE.copy().apply_transform(matrix)
    assert found["deep"].mesh.volume == pytest.approx(8) and found["alone"].mesh.volume == pytest.approx(1)
    np.testing.assert_allclose(found["deep"].mesh.bounds, expected.bounds, atol=1e-5)


def test_instances(make):
    """Four pillars of one node: one moved, one turned, one scaled, one mirrored."""
    instances = {
        "TRANSLATION": make.array([(0, 0, 0), (5, 0, 0), (0, 5, 0), (5, 5, 0)]),
        "ROTATION": make.array([(0, 0, 0, 127), (0, 0, 90, 90), (0, 0, 0, 127), (0, 0, 0, 127)], "i1", normalized=True),
        "SCALE": make.array([(1, 1, 1), (1, 1, 1), (1, 1, 3), (-1, 1, 1)]),
    }
    node = {"mesh": 0, "name": "pillar", "translation": [100, 0, 0]}
    node["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": instances}}
    data = make.glb(
        meshes=[{"primitives": [make.box((0, 0, 0), (1, 2, 1))]}],
        nodes=[node],
        extensionsRequired=["EXT_mesh_gpu_instancing"],
    )
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


# --- names and scenes ----------------------------------------------------------------------------------------


def test_names_of_parts(make):
    wall = {"attributes": {"POSITION": make.array(SQUARE)}, "mode": 6}
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
    assert file.header == "a test"


def test_other_scenes_and_nodes_are_named(make):
    wall = {"attributes": {"POSITION": make.array(SQUARE)}, "mode": 6}
    data = make.glb(
        meshes=[{"primitives": [wall]}, {"primitives": [wall], "name": "spare"}],
        nodes=[
            {"mesh": 0, "name": "room"},
            {"mesh": 0, "name": "shed"},
            {"mesh": 0, "name": "lost"},
            {"name": "camera"},
            {"name": "circle", "children": [5]},
            {"mesh": 0, "name": "in a circle", "children": [4]},
        ],
        scenes=[{"nodes": [1]}, {"nodes": [0, 3]}],
        scene=1,
    )
    file = read_gltf(data, PATH)
    assert [part.name for part in file.parts] == ["room"]
    assert file.left_out == (
        'nodes outside the scene that the file shows were left out: "shed", "lost", "in a circle"',
        'meshes that no node shows were left out: "spare"',
    )


def test_without_scenes_all_nodes_are_read(make):
    wall = {"attributes": {"POSITION": make.array(SQUARE)}, "mode": 6}
    nodes = [{"children": [1], "translation": [0, 0, 1]}, {"mesh": 0, "name": "wall"}]
    header = make.header(meshes=[{"primitives": [wall]}], nodes=nodes)
    del header["scenes"], header["scene"]
    header["buffers"][0]["uri"] = json.loads(make.gltf())["buffers"][0]["uri"]
    assert one(json.dumps(header).encode()).bounds[0, 2] == 1


# --- extensions ----------------------------------------------------------------------------------------------


def test_extensions_that_are_not_required_are_named(make):
    primitive = make.box((0, 0, 0), (1, 1, 1), extensions={"KHR_materials_variants": {}, "ACME_bend": {}})
    nodes = [{"mesh": 0, "name": "wall", "extensions": {"KHR_node_visibility": {"visible": False}}}]
    file = read_gltf(make.glb(meshes=[{"primitives": [primitive]}], nodes=nodes), PATH)
    assert file.left_out == tuple(
        f'the extension "{name}" is unknown and was not applied, for example to "wall"'
        for name in ("KHR_node_visibility", "ACME_bend")
    )


def test_extensions_of_a_group_are_named():
    make = GltfBuilder()
    meshes = [{"primitives": [make.box((0, 0, 0), (1, 1, 1))]}]
    hidden = {"name": "shutters", "children": [0], "extensions": {"KHR_node_visibility": {"visible": False}}}
    nodes = [{"mesh": 0, "name": "closed shutter"}, hidden]
    file = read_gltf(make.glb(meshes=meshes, nodes=nodes, scenes=[{"nodes": [1]}]), PATH)
    assert len(file.parts) == 1 and "KHR_node_visibility" in file.left_out[0]
