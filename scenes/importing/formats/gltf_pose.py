"""The pose of a glTF mesh at rest: its morph targets and its skin."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Integer

from scenes.files.errors import InputError
from scenes.importing.formats.gltf_arrays import Arrays
from scenes.importing.formats.gltf_header import Primitive, pick

Vertices = Float[np.ndarray, "V 3"]
Used = Integer[np.ndarray, " V"]


def morphed(vertices: Vertices, used: Used, part: Primitive, weights: list[float], arrays: Arrays) -> Vertices:
    """Return vertices moved by the morph targets."""
    for target, weight in zip(part.targets, weights, strict=False):
        if weight and "POSITION" in target:
            vertices = vertices + weight * _rows(target["POSITION"], "VEC3", used, arrays)
    return vertices


def skinned(
    vertices: Vertices,
    used: Used,
    part: Primitive,
    skin: int,
    places: dict[int, np.ndarray],
    arrays: Arrays,
    label: str,
) -> Vertices:
    """Return vertices in the world, moved with the joints of a skin: Σ w J B v / Σ w (glTF 2.0, section 3.7.3).

    J are the places of the joints and B their inverse bind matrices. The place of the mesh's own node does not count.
    """
    entry = pick(arrays.header.skins, skin, arrays.source, "skins")
    if not all(joint in places for joint in entry.joints):
        raise InputError(f"{label}: expected the joints of the skin in the scene, found one outside it")
    joints = np.array([places[joint] for joint in entry.joints]).reshape(-1, 4, 4)
    if entry.inverse_bind_matrices is not None:
        bind = arrays.read(entry.inverse_bind_matrices, "MAT4").reshape(-1, 4, 4).transpose(0, 2, 1)
        if len(bind) < len(joints):
            raise InputError(f"{label}: expected {len(joints)} inverse bind matrices, found {len(bind)}")
        joints = joints @ bind[: len(joints)]
    moved, total = np.zeros_like(vertices), np.zeros(len(vertices))
    for name in part.attributes:
        group = name.removeprefix("JOINTS_")
        if group == name or f"WEIGHTS_{group}" not in part.attributes:
            continue
        numbers = _rows(part.attributes[name], "VEC4", used, arrays).astype(int)
        weights = _rows(part.attributes[f"WEIGHTS_{group}"], "VEC4", used, arrays).astype(float)
        if (numbers >= len(joints)).any():
            raise InputError(f"{label}: expected joints from 0 to {len(joints) - 1}, found {numbers.max()}")
        for number, weight in zip(numbers.T, weights.T, strict=True):
            turned = np.einsum("vij,vj->vi", joints[number, :3, :3], vertices) + joints[number, :3, 3]
            moved += weight[:, None] * turned
            total += weight
    return moved / np.where(total, total, 1)[:, None]


def _rows(index: int, kind: str, used: Used, arrays: Arrays) -> np.ndarray:
    """Return the rows of an accessor that belong to the used vertices."""
    values = arrays.read(index, kind)
    if len(used) and used[-1] >= len(values):
        raise InputError(
            f"{arrays.source}: accessors[{index}]: expected an entry for each vertex, found {len(values)} entries"
        )
    return values[used]
