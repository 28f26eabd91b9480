"""What a mesh file contains: its parts with their names, what was left out, and what it says about its exporter."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from trimesh import Trimesh


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
    """Name the parts of a node.

    >>> glass, brick = Trimesh(), Trimesh()
    >>> [part.name for part in parts_of_node("Facade", "house", {"glass": glass, "brick": brick})]
    ['Facade/glass', 'Facade/brick']
    >>> parts_of_node("", "house", {"glass": glass})[0].name
    'house'
    """
    name = node or otherwise
    return [
        MeshPart(f"{name}/{material}" if material is not None and len(meshes) > 1 else name, mesh, node, material)
        for material, mesh in meshes.items()
    ]
