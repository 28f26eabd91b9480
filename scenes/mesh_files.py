"""Read mesh files: every mesh with its name, in the file's own unit and axes."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import trimesh
from trimesh import Trimesh

from scenes.errors import InputError

MESH_SUFFIXES = (".glb", ".gltf", ".obj", ".off", ".ply", ".stl")

READER_ERRORS = (
    ArithmeticError,
    AssertionError,
    AttributeError,
    EOFError,
    ImportError,
    LookupError,
    NotImplementedError,
    OSError,
    TypeError,
    ValueError,
    struct.error,
)
"""Errors that trimesh's readers raise on a damaged or unsupported file."""


def default_up(path: Path) -> str:
    """The vertical axis: "y" for glTF, as its specification says (section 3.4), "z" for all others."""
    return "y" if path.suffix.lower() in (".glb", ".gltf") else "z"


def read_meshes(path: Path) -> list[tuple[str, Trimesh]]:
    """Every mesh of a file with its node's name, node transforms applied, in the file's own unit and axes.

    Vertices and triangles are as the file has them: nothing is merged or dropped.

    Args:
        path: the mesh file.

    Returns:
        Pairs of a name and a mesh, in the order of the names.

    Raises:
        InputError: no such file, an unsupported format, an unreadable file, or one without triangles.
    """
    if path.suffix.lower() not in MESH_SUFFIXES:
        known = ", ".join(MESH_SUFFIXES)
        raise InputError(f'{path}: "{path.suffix}" is not a mesh format we read; expected one of {known}')
    if not path.is_file():
        raise InputError(f"{path}: no such mesh file")
    options: dict[str, Any] = {"process": False}
    if path.suffix.lower() == ".obj":
        options |= {"split_objects": True, "split_groups": True, "group_material": False}
    try:
        loaded = trimesh.load_scene(path, **options)
        nodes = [(node, *loaded.graph.get(node)) for node in loaded.graph.nodes_geometry]
        meshes = [
            (str(node), loaded.geometry[key].copy().apply_transform(transform))
            for node, transform, key in sorted(nodes, key=lambda n: str(n[0]))
            if isinstance(loaded.geometry[key], Trimesh) and len(loaded.geometry[key].faces)
        ]
    except READER_ERRORS as error:
        raise InputError(f"{path}: not a readable {path.suffix[1:].upper()} file ({error})") from error
    if not meshes:
        raise InputError(f"{path}: holds no triangles (is it a point cloud?)")
    if path.suffix.lower() in (".ply", ".stl", ".off"):  # formats without names
        meshes = [(path.stem, mesh) for _, mesh in meshes]
    return meshes
