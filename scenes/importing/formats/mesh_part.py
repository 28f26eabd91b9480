"""What a mesh file contains: its parts with their names, what was left out, and what it says about its exporter."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Integer
from trimesh import Trimesh

from scenes.files.errors import InputError
from scenes.scene.description import MOST_TRIANGLES

LARGEST = 1e10
"""Largest coordinate, in the file's unit: that of UTM in millimetres. Damaged files have coordinates such as 1e30."""


@dataclass(frozen=True)
class MeshPart:
    """The triangles of one object that have one material."""

    # the node's name or, if the node has parts of several materials, "node/material". The same in each import.
    name: str
    mesh: Trimesh  # the triangles, in the file's own unit and axes, with the transforms of the nodes applied
    # name of the node (glTF), of the object and group (OBJ) or of the solid (STL); empty if there is none
    node: str = ""
    material: str | None = None  # name of the material in the file, or None


@dataclass(frozen=True)
class MeshFile:
    """The content of a mesh file."""

    parts: list[MeshPart]  # in the order of their names
    # a sentence for each thing in the file that was not read, or not in the only possible way
    left_out: tuple[str, ...] = ()
    header: str = ""  # what the file says about the program that wrote it; empty if it says nothing


def parts_of_node(node: str, otherwise: str, meshes: Mapping[str | None, Trimesh]) -> list[MeshPart]:
    """Name the parts of a node."""
    name = node or otherwise
    return [
        MeshPart(f"{name}/{material}" if material is not None and len(meshes) > 1 else name, mesh, node, material)
        for material, mesh in meshes.items()
    ]


def require_ordinary(vertices: Float[np.ndarray, "V 3"], label: str) -> None:
    """Refuse coordinates that are not finite or that are absurdly large."""
    faulty = np.flatnonzero(~(np.abs(vertices) <= LARGEST).all(axis=1))  # also NaN
    if len(faulty):
        raise InputError(
            f"{label}: expected coordinates within ±{LARGEST:g}, found {vertices[faulty[0]].tolist()} at vertex "
            f"{faulty[0]}, counted from 0 ({len(faulty)} of {len(vertices)} vertices have this fault)"
        )


def require_corners(faces: Integer[np.ndarray, "F n"], count: int, label: str) -> None:
    """Refuse faces that refer to vertices that do not exist."""
    outside = (faces < 0) | (faces >= count)
    if outside.any():
        row, column = np.argwhere(outside)[0]
        raise InputError(
            f"{label}: expected corners with vertex numbers from 0 to {count - 1}, found {faces[row, column]} in face "
            f"{row}, counted from 0"
        )


def require_few(triangles: int, label: str) -> None:
    """Refuse more triangles than ``MOST_TRIANGLES``. Raise an InputError that starts with the label."""
    if triangles > MOST_TRIANGLES:
        raise InputError(f"{label}: expected at most {MOST_TRIANGLES} triangles, found {triangles}")
