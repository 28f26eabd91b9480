"""Where the nodes of a glTF file's scene are, and their instances."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Integer
from scipy.spatial.transform import Rotation

from scenes.files.errors import InputError, shown
from scenes.importing.formats.gltf_arrays import Arrays
from scenes.importing.formats.gltf_header import DEEPEST, Header, Node, instances, pick

Places = Float[np.ndarray, "n 4 4"]


def node_places(header: Header, source: str) -> dict[int, Float[np.ndarray, "4 4"]]:
    """Return the transforms to the world of the nodes of the scene, by their numbers.

    The scene is the default one, or else the first; without any, all nodes without a parent are taken.
    """
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


def instance_places(node: Node, arrays: Arrays, label: str) -> Places:
    """Return the places of a node's instances relative to the node; one place if it has none."""
    kinds = {"TRANSLATION": "VEC3", "ROTATION": "VEC4", "SCALE": "VEC3"}
    entries = instances(node, label)
    found = {name: arrays.read(entries[name], kind) for name, kind in kinds.items() if name in entries}
    counts = {len(each) for each in found.values()} or {1}
    if len(counts) > 1:
        raise InputError(f"{label}: expected as many translations as rotations and scales, found {sorted(counts)}")
    at_rest = {"TRANSLATION": [0, 0, 0], "ROTATION": [0, 0, 0, 1], "SCALE": [1, 1, 1]}
    moves, turns, scales = (found.get(name, np.tile(rest, (*counts, 1))) for name, rest in at_rest.items())
    return _transforms(moves, turns, scales, label)


def repeat(
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
