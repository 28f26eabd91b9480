"""What a file contains: parts with names, the radio materials that these stand for, what was left out."""

from __future__ import annotations

import re
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float, Integer
from trimesh import Trimesh

from scenes.files.errors import InputError, did_you_mean, named
from scenes.scene.description import MOST_TRIANGLES
from scenes.scene.materials import P2040, VALUES, RadioMaterial, p2040_material

LARGEST = 1e10
"""Largest coordinate, in the file's unit: that of UTM in millimetres. Damaged files have coordinates such as 1e30."""


BLENDERS_NUMBER = re.compile(r"\.\d{3}$", re.ASCII)  # Blender numbers copies: Wall, Wall.001, Wall.002


@dataclass(frozen=True)
class ImportedPart:
    """The triangles of one object that have one material. They become an object of the scene."""

    # the node's name or, if the node has parts of several materials, "node/material". The same in each import.
    name: str
    mesh: Trimesh  # the triangles, in the file's own unit and axes, with the transforms of the nodes applied
    # name of the node (glTF), of the object and group (OBJ), of the solid (STL) or of the shape; empty if there is none
    node: str = ""
    material: str | None = None  # name of the material in the file, or the id of a bsdf; None if the file has none
    mesh_file: str | None = None  # name of the mesh file without its suffix, if a scene XML names one

    def names(self) -> list[str]:
        """Return all names that a material rule may use, without repetitions. Blender's numbers may be left out."""
        node, material = self.node, self.material or ""
        each = [self.name, node, material, material.removeprefix("mat-"), self.mesh_file or ""]
        each += [short_name(name) for name in each]
        if node and material:
            each += [f"{node}/{material}", f"{short_name(node)}/{short_name(material)}"]
        return list(dict.fromkeys(filter(None, each)))

    def radio_material(self, frequency: float, own: Mapping[str, RadioMaterial]) -> RadioMaterial | None:
        """The radio material that the file states: the one that its name stands for."""
        known = None if self.material is None else known_material(self.material, own)
        return None if known is None else material_at(known, frequency, own)


@dataclass(frozen=True)
class ImportedFile:
    path: Path  # the file
    parts: Sequence[ImportedPart]  # of a mesh file in the order of their names, of a scene XML in the order of the file
    up: str  # "y" or "z", the vertical axis of this kind of file
    # a sentence for each thing in the file that was not read, or not in the only possible way
    left_out: tuple[str, ...] = ()
    blender: bool = False  # whether it is an OBJ file by Blender, which writes y up unless told otherwise


def short_name(name: str) -> str:
    """Return a name without the number that Blender gives to a copy."""
    return BLENDERS_NUMBER.sub("", name)


def parts_of_node(node: str, otherwise: str, meshes: Mapping[str | None, Trimesh]) -> list[ImportedPart]:
    name = node or otherwise
    return [
        ImportedPart(f"{name}/{material}" if material is not None and len(meshes) > 1 else name, mesh, node, material)
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


def known_material(name: str, own: Mapping[str, RadioMaterial]) -> str | None:
    """The material that a name stands for; case, spaces, "mat-", "itu_" and Blender's number do not count."""
    table = {_plain(known): known for known in (*P2040, *own)}
    return name if name in own else table.get(_plain(name))


def _plain(name: str) -> str:
    bare = re.sub(r"^(mat-)?(itu[_-])?", "", short_name(name.strip()), flags=re.IGNORECASE)
    return re.sub(r"[ -]", "_", bare).casefold()


def require_known(name: str, own: Mapping[str, RadioMaterial]) -> None:
    """Refuse the name of a material that is neither the user's own nor one of ITU-R P.2040."""
    known = (*own, *P2040)
    if name in known:
        return
    hint = did_you_mean(name, known)
    if not hint.endswith("?"):
        hint += f" (or give its values: --own-material {shlex.quote(f'{name}={VALUES}')})"
    raise InputError(f"unknown material {named(name)}; {hint}")


def material_at(name: str, frequency: float, own: Mapping[str, RadioMaterial]) -> RadioMaterial:
    return replace(own[name], name=name) if name in own else p2040_material(name, frequency)


def proposed_rule(name: str) -> str:
    """Write a rule for a name, without its material, that the user can copy into a shell. No option begins with "?"."""
    return shlex.quote(f"?{name[1:]}=MATERIAL" if name.startswith("-") else f"{name}=MATERIAL")
