"""Read a mesh file or a scene XML as parts, in one form: shapes, names, and what the file says of their materials."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from trimesh import Trimesh

from scenes.importing.file_materials import short_name
from scenes.importing.mesh_files import MESH_SUFFIXES, default_up, read_mesh_file
from scenes.importing.mitsuba_xml import SIONNA, MitsubaShape, read_mitsuba, sionna_scene
from scenes.scene.description import LONGEST_NAME


@dataclass(frozen=True)
class ImportedPart:
    """A part of a file, which becomes an object."""

    name: str  # name of the object, different for each part
    mesh: Trimesh  # the triangles, in the file's own unit and axes
    node: str = ""  # name of the node, object, group, solid or shape; empty if the file has none
    material: str | None = None  # name of the material in the file, or the id of a bsdf; None if the file has none
    mesh_file: str | None = None  # name of the mesh file without its suffix, if a scene XML names one
    shape: MitsubaShape | None = None  # the shape of a scene XML; None for a mesh file

    def names(self) -> list[str]:
        """Return all names that a material rule may use, without repetitions. Blender's numbers may be left out."""
        node, material = self.node, self.material or ""
        each = [self.name, node, material, material.removeprefix("mat-"), self.mesh_file or ""]
        each += [short_name(name) for name in each]
        if node and material:
            each += [f"{node}/{material}", f"{short_name(node)}/{short_name(material)}"]
        return list(dict.fromkeys(filter(None, each)))


@dataclass(frozen=True)
class ImportedFile:
    """The content of a mesh file or a scene XML."""

    path: Path  # the file
    parts: list[ImportedPart]  # in the order of the file
    up: str  # "y" or "z", the vertical axis of this kind of file
    left_out: tuple[str, ...] = ()  # a sentence for each thing in the file that was not read
    header: str = ""  # what the file says about the program that wrote it


def is_importable(name: str) -> bool:
    """Whether ``read_file`` reads this: a mesh, a scene XML, or "sionna:" and a name."""
    return name.startswith(SIONNA) or Path(name).suffix.lower() in (*MESH_SUFFIXES, ".xml")


def read_file(name: str | Path) -> ImportedFile:
    """Read the parts of a mesh file or a scene XML."""
    path = sionna_scene(str(name)) if str(name).startswith(SIONNA) else Path(name)
    if path.suffix.lower() == ".xml":
        shapes = read_mitsuba(path)
        parts = [
            ImportedPart(
                plain_name(each.name), each.mesh, plain_name(each.name), _plain(each.bsdf_id), each.mesh_file, each
            )
            for each in shapes
        ]
        left_out = tuple(sentence for shape in shapes for sentence in shape.left_out)
        return ImportedFile(path, _numbered(parts), default_up(path), left_out)
    file = read_mesh_file(path)
    parts = [
        ImportedPart(plain_name(each.name), each.mesh, _plain(each.node) or "", _plain(each.material))
        for each in file.parts
    ]
    return ImportedFile(path, _numbered(parts), default_up(path), file.left_out, file.header)


def plain_name(name: str) -> str:
    r"""Make a name valid for a scene: replace unprintable characters by "_", cut a long name, name what has none."""
    return "".join(c if c.isprintable() else "_" for c in name[:LONGEST_NAME]) or "unnamed"


def _plain(name: str | None) -> str | None:
    """Make a name valid; None if there is none."""
    return plain_name(name) if name else None


def _numbered(parts: Sequence[ImportedPart]) -> list[ImportedPart]:
    """Number repeated names in the order of the file."""
    names, used, seen = {part.name for part in parts}, set[str](), Counter[str]()
    numbered = []
    for part in parts:
        unique = part.name
        while unique in used or (unique != part.name and unique in names):
            seen[part.name] += 1
            number = f"_{seen[part.name] + 1}"
            unique = part.name[: LONGEST_NAME - len(number)] + number
        used.add(unique)
        numbered.append(replace(part, name=unique))
    return numbered
