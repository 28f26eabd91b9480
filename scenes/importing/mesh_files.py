"""Read the meshes in a file with their names, in the file's own unit and axes."""

from __future__ import annotations

import struct
from io import BytesIO
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
import trimesh
from trimesh import Trimesh
from trimesh.resolvers import Resolver

from scenes.files.errors import InputError, named, shown
from scenes.files.input_file import MEGABYTE, beside, read_bytes
from scenes.importing.formats.gltf_header import check_gltf
from scenes.importing.formats.mesh_part import MeshFile, MeshPart
from scenes.scene.description import MOST_TRIANGLES

MESH_SUFFIXES = (".glb", ".gltf", ".obj", ".off", ".ply", ".stl")

LARGEST_FILE = 256 * MEGABYTE
"""Most bytes of a mesh file, and of all files together that a glTF file names."""

LARGEST = 1e9
"""Largest coordinate, in the file's unit. Damaged files have coordinates such as 1e30."""

READER_ERRORS = (
    ArithmeticError,
    AssertionError,
    AttributeError,
    BufferError,
    EOFError,
    ImportError,
    LookupError,
    MemoryError,
    NameError,
    OSError,
    RuntimeError,
    TypeError,
    ValueError,
    struct.error,
)
"""Errors that trimesh's readers raise on a damaged or unsupported file."""


class Neighbours(Resolver):
    """Gives trimesh the files that a glTF file names: regular files in its folder or below, nothing from the network.

    Args:
        path: the glTF file.
    """

    def __init__(self, path: Path) -> None:
        self.path, self.file_name = path, path.name  # trimesh names the only mesh of an OBJ file after the file
        self.left = LARGEST_FILE

    def get(self, key: str) -> bytes:
        try:
            data = read_bytes(beside(self.path, unquote(key)), "a buffer of glTF", self.left)
        except InputError as error:
            raise InputError(f"{self.path}: buffers: {error}") from None
        self.left -= len(data)
        return data

    def write(self, name: str, data: object) -> None:
        raise NotImplementedError

    def namespaced(self, namespace: str) -> Resolver:
        raise NotImplementedError

    def keys(self) -> tuple[str, ...]:
        return ()


def default_up(path: Path) -> str:
    """Return the vertical axis of a file: "y" for glTF, as its specification says (section 3.4), else "z"."""
    return "y" if path.suffix.lower() in (".glb", ".gltf") else "z"


def read_mesh_file(path: Path) -> MeshFile:
    """Read the parts of a mesh file, with the transforms of their nodes applied, in the file's own unit and axes.

    Vertices and triangles are kept as they are in the file. Textures are not read.

    Args:
        path: the mesh file.

    Raises:
        InputError: the file is not a regular file, has an unsupported format, cannot be read, or has no triangles or
            too many; or a coordinate is too large or not finite; or a triangle refers to a vertex that does not exist.
    """
    suffix = path.suffix.lower()
    if suffix not in MESH_SUFFIXES:
        known = ", ".join(MESH_SUFFIXES)
        raise InputError(f"{path}: expected a mesh file with one of the suffixes {known}, found {named(path.suffix)}")
    data = read_bytes(path, "a mesh", LARGEST_FILE)
    if suffix in (".glb", ".gltf"):
        check_gltf(data, str(path), 2 * LARGEST_FILE, MOST_TRIANGLES)
    options: dict[str, Any] = {"process": False}
    if suffix in (".glb", ".gltf", ".obj", ".ply"):
        options |= {"skip_materials": True}
    if suffix == ".obj":
        options |= {"split_objects": True, "split_groups": True, "group_material": False}
    try:
        with np.errstate(all="ignore"):  # numbers that are not finite are refused below
            loaded = trimesh.load_scene(BytesIO(data), file_type=suffix[1:], resolver=Neighbours(path), **options)
            nodes = sorted(((str(node), *loaded.graph.get(node)) for node in loaded.graph.nodes_geometry), key=_name)
            parts = [(name, loaded.geometry[key], transform) for name, transform, key in nodes]
            parts = [part for part in parts if isinstance(part[1], Trimesh) and len(part[1].faces)]
            triangles = sum(len(mesh.faces) for _, mesh, _ in parts)
            if triangles > MOST_TRIANGLES:
                raise InputError(f"{path}: expected at most {MOST_TRIANGLES} triangles, found {triangles}")
            for name, mesh, _ in parts:
                require_corners(mesh, f"{path}: {shown(name)}")
            meshes = [(name, mesh.copy().apply_transform(transform)) for name, mesh, transform in parts]
    except InputError:
        raise
    except READER_ERRORS as error:
        kind = suffix[1:].upper()
        raise InputError(
            f"{path}: expected a mesh as {kind}, found a file that cannot be read ({_reason(error)})"
        ) from error
    if not meshes:
        raise InputError(f"{path}: expected a mesh with triangles, found none (is it a point cloud?)")
    for name, mesh in meshes:
        require_ordinary(mesh, f"{path}: {shown(name)}")
    if suffix in (".ply", ".stl", ".off"):  # formats without names
        return MeshFile([MeshPart(path.stem, mesh) for _, mesh in meshes])
    return MeshFile([MeshPart(name, mesh, name) for name, mesh in meshes])


def _name(node: tuple[Any, ...]) -> str:
    return node[0]


def _reason(error: Exception) -> str:
    return shown(str(error) or type(error).__name__)


def require_corners(mesh: Trimesh, label: str) -> None:
    """Refuse triangles that refer to vertices that do not exist, and vertices without three coordinates.

    Args:
        mesh: any mesh.
        label: the start of the message.

    Raises:
        InputError: a triangle refers to a vertex number that the mesh does not have, or a vertex does not have three
            coordinates.
    """
    if mesh.vertices.shape[1:] != (3,):
        raise InputError(
            f"{label}: expected vertices of three coordinates, found {mesh.vertices.shape[1]}: "
            f"{mesh.vertices[0].tolist()}"
        )
    outside = (mesh.faces < 0) | (mesh.faces >= len(mesh.vertices))
    if outside.any():
        row, column = np.argwhere(outside)[0]
        raise InputError(
            f"{label}: expected corners with vertex numbers from 0 to {len(mesh.vertices) - 1}, found "
            f"{mesh.faces[row, column]} in triangle {row}"
        )


def require_ordinary(mesh: Trimesh, label: str) -> None:
    """Refuse coordinates that are not finite or that are absurdly large.

    Args:
        mesh: any mesh.
        label: the start of the message.

    Raises:
        InputError: a coordinate is not within ±``LARGEST``.
    """
    vertices = np.asarray(mesh.vertices)
    faulty = np.flatnonzero(~(np.abs(vertices) <= LARGEST).all(axis=1))  # also NaN
    if len(faulty):
        raise InputError(
            f"{label}: expected coordinates within ±{LARGEST:g}, found {vertices[faulty[0]].tolist()} at vertex "
            f"{faulty[0]}, counted from 0 ({len(faulty)} of {len(vertices)} vertices have this fault)"
        )
