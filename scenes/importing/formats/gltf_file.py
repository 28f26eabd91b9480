"""Read glTF 2.0: the triangles of the nodes of a scene, with names and materials.

trimesh skips triangle fans, does not convert normalised integers, ignores instances, skins and morph targets, and names
parts of several materials at random. pygltflib reads the JSON, which ``gltf_header`` checks as well, but no arrays.
"""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path

import numpy as np
from jaxtyping import Float, Integer
from trimesh import Trimesh

from scenes.files.errors import InputError, shown
from scenes.importing.formats.gltf_arrays import LARGEST_FILE, Arrays
from scenes.importing.formats.gltf_header import FAN, STRIP, Primitive, check_sizes, node_name, pick, read_header
from scenes.importing.formats.gltf_left_out import has_triangles, left_out
from scenes.importing.formats.gltf_nodes import instance_places, node_places, repeat
from scenes.importing.formats.gltf_pose import morphed, skinned
from scenes.importing.formats.mesh_checks import require_corners, require_ordinary
from scenes.importing.formats.mesh_part import MeshFile, MeshPart, parts_of_node
from scenes.importing.formats.strips import fan_triangles, strip_triangles
from scenes.scene.description import MOST_TRIANGLES

Vertices = Float[np.ndarray, "V 3"]
Faces = Integer[np.ndarray, "F 3"]


def read_gltf(data: bytes, path: Path) -> MeshFile:
    """Read the triangles of a glTF file's scene, with a part for each node and material.

    Skins and morph targets are applied as in the pose at rest. Where a node mirrors its mesh, the outer sides of the
    triangles stay outside.
    """
    header, binary = read_header(data, str(path))
    check_sizes(header, str(path), 2 * LARGEST_FILE, MOST_TRIANGLES)
    arrays = Arrays(header, binary, path)
    parts: list[MeshPart] = []
    with np.errstate(all="ignore"):  # numbers that are not finite are refused
        places = node_places(header, str(path))
        for index in sorted(places):
            name = node_name(header, index)
            parts += parts_of_node(name, name, _meshes(index, places, arrays, f"{path}: {shown(name)}"))
    return MeshFile(parts, tuple(left_out(header, places)), header.asset.generator)


def _meshes(index: int, places: dict[int, np.ndarray], arrays: Arrays, label: str) -> dict[str | None, Trimesh]:
    """Return the triangles of a node by material, in the world."""
    header, node = arrays.header, arrays.header.nodes[index]
    if node.mesh is None:
        return {}
    mesh = pick(header.meshes, node.mesh, arrays.source, "meshes")
    by_material: dict[str | None, list[tuple[Vertices, Faces]]] = defaultdict(list)
    for part in filter(has_triangles, mesh.primitives):
        positions = arrays.read(part.attributes["POSITION"], "VEC3")
        faces = _faces(part, len(positions), arrays, label)
        require_corners(faces, len(positions), label)
        used, corners = np.unique(faces, return_inverse=True)
        faces = corners.reshape(-1, 3)
        vertices = morphed(positions[used].astype(float), used, part, node.weights or mesh.weights, arrays)
        require_ordinary(vertices, label)
        if node.skin is not None and "JOINTS_0" in part.attributes:
            vertices = skinned(vertices, used, part, node.skin, places, arrays, label)
        else:
            vertices, faces = repeat(vertices, faces, places[index] @ instance_places(node, arrays, label))
        require_ordinary(vertices, label)
        by_material[_material(part, arrays)].append((vertices, faces))
    return {material: _joined(pieces) for material, pieces in by_material.items()}


def _faces(part: Primitive, count: int, arrays: Arrays, label: str) -> Faces:
    """Return the triangles of a primitive as vertex numbers."""
    corners = np.arange(count) if part.indices is None else arrays.read(part.indices, "SCALAR").astype(int)
    if part.mode == STRIP:
        return strip_triangles(corners)
    if part.mode == FAN:
        return fan_triangles(corners)
    if len(corners) % 3:
        raise InputError(f"{label}: expected three corners for each triangle, found {len(corners)} corners")
    return corners.reshape(-1, 3)


def _material(part: Primitive, arrays: Arrays) -> str | None:
    if part.material is None:
        return None
    name = pick(arrays.header.materials, part.material, arrays.source, "materials").name
    return name or f"material_{part.material}"


def _joined(pieces: list[tuple[Vertices, Faces]]) -> Trimesh:
    starts = np.cumsum([0, *(len(vertices) for vertices, _ in pieces)])
    faces = [faces + start for (_, faces), start in zip(pieces, starts, strict=False)]
    return Trimesh(np.concatenate([vertices for vertices, _ in pieces]), np.concatenate(faces), process=False)
