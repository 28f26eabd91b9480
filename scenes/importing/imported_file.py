"""Read a mesh file or a scene XML as parts, in one form: shapes, names, and what the file says of their materials."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from scenes.importing.formats.mesh_part import ImportedFile, ImportedPart
from scenes.importing.mesh_files import MESH_SUFFIXES, read_mesh_file
from scenes.importing.mitsuba_xml import SIONNA, read_mitsuba, sionna_scene
from scenes.scene.description import LONGEST_NAME


def is_importable(name: str) -> bool:
    """Whether ``read_file`` reads this: a mesh, a scene XML, or "sionna:" and a name."""
    return name.startswith(SIONNA) or Path(name).suffix.lower() in (*MESH_SUFFIXES, ".xml")


def read_file(name: str | Path) -> ImportedFile:
    path = sionna_scene(str(name)) if str(name).startswith(SIONNA) else Path(name)
    if path.suffix.lower() == ".xml":
        shapes = read_mitsuba(path)
        file = ImportedFile(path, shapes, "z", tuple(sentence for shape in shapes for sentence in shape.left_out))
    else:
        file = read_mesh_file(path)
    return replace(file, parts=_numbered([_with_plain_names(part) for part in file.parts]))


def plain_name(name: str) -> str:
    r"""Make a name valid for a scene: replace unprintable characters by "_", cut a long name, name what has none."""
    return "".join(c if c.isprintable() else "_" for c in name[:LONGEST_NAME]) or "unnamed"


def _with_plain_names(part: ImportedPart) -> ImportedPart:
    node, material = (plain_name(name) if name else None for name in (part.node, part.material))
    return replace(part, name=plain_name(part.name), node=node or "", material=material)


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
