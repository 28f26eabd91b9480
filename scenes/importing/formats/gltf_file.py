"""Read glTF 2.0: the triangles of the nodes of a scene, with names and materials.

trimesh skips fans, normalised integers and instances, and names parts of several materials at random.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Container, Iterator
from pathlib import Path
from typing import Literal

import numpy as np
from jaxtyping import Float, Integer
from scipy.spatial.transform import Rotation
from trimesh import Trimesh

from scenes.files.errors import InputError, listed, named, shown
from scenes.importing.formats.gltf_arrays import Arrays
from scenes.importing.formats.gltf_header import (
    COMPRESSION,
    DEEPEST,
    FAN,
    POINTS_AND_LINES,
    STRIP,
    Header,
    Node,
    Primitive,
    instances,
    node_name,
    pick,
    read_header,
    unknown,
)
from scenes.importing.formats.mesh_part import (
    ImportedFile,
    ImportedPart,
    parts_of_node,
    require_corners,
    require_ordinary,
)
from scenes.scene.shapes import union

Vertices = Float[np.ndarray, "V 3"]
Faces = Integer[np.ndarray, "F 3"]
Places = Float[np.ndarray, "n 4 4"]

LISTED = 5  # Most names in a sentence


def read_gltf(data: bytes, path: Path) -> ImportedFile:
    """Read the triangles of a glTF file's scene, y up (specification, 3.4), with a part for each node and material."""
    header, binary = read_header(data, str(path))
    arrays = Arrays(header, binary, path)
    parts: list[ImportedPart] = []
    with np.errstate(all="ignore"):  # numbers that are not finite are refused
        places = _node_places(header, str(path))
        for index in sorted(places):
            name = node_name(header, index)
            parts += parts_of_node(name, name, _meshes(index, places[index], arrays, f"{path}: {shown(name)}"))
    return ImportedFile(path, parts, "y", tuple(_left_out(header, places)))


def _meshes(index: int, place: Float[np.ndarray, "4 4"], arrays: Arrays, label: str) -> dict[str | None, Trimesh]:
    """Return the triangles of a node by material, in the world."""
    header, node = arrays.header, arrays.header.nodes[index]
    if node.mesh is None:
        return {}
    mesh = pick(header.meshes, node.mesh, arrays.source, "meshes")
    by_material: dict[str | None, list[Trimesh]] = defaultdict(list)
    for part in filter(_has_triangles, mesh.primitives):
        _require_plain(node, part, node.weights or mesh.weights, label)
        positions = arrays.read(part.attributes["POSITION"], "VEC3")
        faces = _faces(part, len(positions), arrays, label)
        require_corners(faces, len(positions), label)
        used, corners = np.unique(faces, return_inverse=True)
        places = place @ _instance_places(node, arrays, label)
        vertices, faces = _repeat(positions[used].astype(float), corners.reshape(-1, 3), places)
        require_ordinary(vertices, label)
        by_material[_material(part, arrays)].append(Trimesh(vertices, faces, process=False))
    return {material: union(*meshes) for material, meshes in by_material.items()}


def _require_plain(node: Node, part: Primitive, weights: list[float], label: str) -> None:
    """Refuse what moves triangles or draws them in a way that is rare in models of places."""
    found = "triangles in strips" if part.mode == STRIP else None
    found = "a mesh with morph targets" if part.targets and any(weights) else found
    found = "a mesh with a skin" if node.skin is not None else found
    if found is not None:
        raise InputError(
            f"{label}: expected plain triangles, found {found}; make plain triangles of it in the program that wrote "
            "the file (in Blender: Object > Convert > Mesh), and export again"
        )


def _faces(part: Primitive, count: int, arrays: Arrays, label: str) -> Faces:
    corners = np.arange(count) if part.indices is None else arrays.read(part.indices, "SCALAR").astype(int)
    if part.mode == FAN:
        second = np.arange(1, max(len(corners) - 1, 1))
        return corners[np.stack([0 * second, second, second + 1], axis=1)]
    if len(corners) % 3:
        raise InputError(f"{label}: expected three corners for each triangle, found {len(corners)} corners")
    return corners.reshape(-1, 3)


def _material(part: Primitive, arrays: Arrays) -> str | None:
    if part.material is None:
        return None
    name = pick(arrays.header.materials, part.material, arrays.source, "materials").name
    return name or f"material_{part.material}"


def _has_triangles(part: Primitive) -> bool:
    return part.mode not in POINTS_AND_LINES and "POSITION" in part.attributes


def _left_out(header: Header, places: Container[int]) -> Iterator[str]:
    """Yield a sentence for each kind of thing that is not read."""
    without, elsewhere = [], []
    for index, node in enumerate(header.nodes):
        if node.mesh is not None and index not in places:
            elsewhere.append(named(node_name(header, index)))
        elif node.mesh is not None and not all(map(_has_triangles, header.meshes[node.mesh].primitives)):
            without.append(named(node_name(header, index)))
    used = {node.mesh for node in header.nodes}
    unused = [named(mesh.name or f"mesh_{index}") for index, mesh in enumerate(header.meshes) if index not in used]
    if without:
        yield f"points and lines were left out, in {listed(without, LISTED)}"
    if elsewhere:
        yield f"nodes outside the scene that the file shows were left out: {listed(elsewhere, LISTED)}"
    if unused:
        yield f"meshes that no node shows were left out: {listed(unused, LISTED)}"
    if further := [named(name) for name in unknown(header.extensions_used) if name not in COMPRESSION]:
        yield f"unknown extensions were not applied: {listed(further, LISTED)}"
    if header.animations:
        yield f"animations were left out: {len(header.animations)} in the file; the pose at rest was read"


def _node_places(header: Header, source: str) -> dict[int, Float[np.ndarray, "4 4"]]:
    """Places in the world of the nodes of the default scene, or of the first, or below all without a parent."""
    if header.scenes:
        roots = pick(header.scenes, header.scene, source, "scenes").nodes
    else:
        children = {child for node in header.nodes for child in node.children}
        roots = [index for index in range(len(header.nodes)) if index not in children]
    places: dict[int, np.ndarray] = {}
    level = [(index, np.eye(4)) for index in roots]
    for _ in range(DEEPEST):
        below = []
        for index, parent in level:
            if index in places:
                raise InputError(f"{source}: expected a tree of nodes, found a node that occurs twice")
            node = pick(header.nodes, index, source, "nodes")
            places[index] = parent @ _transform(node, f"{source}: nodes[{index}]")
            below += [(child, places[index]) for child in node.children]
        level = below
        if not level:
            return places
    raise InputError(f"{source}: expected nodes at most {DEEPEST} levels deep, found more")


def _instance_places(node: Node, arrays: Arrays, label: str) -> Places:
    """Return the places of a node's instances relative to the node; one place if it has none."""
    kinds: dict[str, Literal["VEC3", "VEC4"]] = {"TRANSLATION": "VEC3", "ROTATION": "VEC4", "SCALE": "VEC3"}
    entries = instances(node, label)
    found = {name: arrays.read(entries[name], kind) for name, kind in kinds.items() if name in entries}
    counts = {len(each) for each in found.values()} or {1}
    if len(counts) > 1:
        raise InputError(f"{label}: expected as many translations as rotations and scales, found {sorted(counts)}")
    at_rest = {"TRANSLATION": [0, 0, 0], "ROTATION": [0, 0, 0, 1], "SCALE": [1, 1, 1]}
    moves, turns, scales = (found.get(name, np.tile(rest, (*counts, 1))) for name, rest in at_rest.items())
    return _transforms(moves, turns, scales, label)


def _repeat(
    vertices: Float[np.ndarray, "V 3"], faces: Integer[np.ndarray, "F 3"], places: Places
) -> tuple[np.ndarray, np.ndarray]:
    """Put triangles at several places. Mirrored ones are turned over (glTF 2.0, section 3.7.4)."""
    moved = np.einsum("nij,vj->nvi", places[:, :3, :3], vertices) + places[:, None, :3, 3]
    repeated = faces + len(vertices) * np.arange(len(places))[:, None, None]
    mirrored = np.linalg.det(places[:, :3, :3]) < 0
    repeated[mirrored] = repeated[mirrored][:, :, ::-1]
    return moved.reshape(-1, 3), repeated.reshape(-1, 3)


def _transforms(
    translations: Float[np.ndarray, "n 3"],
    rotations: Float[np.ndarray, "n 4"],
    scales: Float[np.ndarray, "n 3"],
    label: str,
) -> Places:
    """Return transforms that scale, then turn by quaternions x, y, z, w, then move."""
    try:
        turned = Rotation.from_quat(rotations).as_matrix()
    except ValueError:
        raise InputError(f"{label}: expected a rotation by quaternions of a length above 0, found others") from None
    result = np.tile(np.eye(4), (len(translations), 1, 1))
    result[:, :3, :3] = turned * np.asarray(scales)[:, None, :]
    result[:, :3, 3] = translations
    return result


def _transform(node: Node, label: str) -> Float[np.ndarray, "4 4"]:
    if node.matrix is None:
        return _transforms(np.array([node.translation]), np.array([node.rotation]), np.array([node.scale]), label)[0]
    matrix = np.reshape(node.matrix, (4, 4)).T  # columns first
    if not np.array_equal(matrix[3], [0, 0, 0, 1]):
        raise InputError(f"{label}: expected an affine transform as matrix, found {shown(node.matrix)}")
    return matrix
