"""Turn the parts of a file into objects with materials, in metres, z up, or into a list of what they would become."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from jaxtyping import Float
from trimesh import Trimesh

from scenes.files.errors import InputError, named
from scenes.files.lengths import METRES, rounded
from scenes.importing.formats.mesh_part import ImportedFile
from scenes.importing.imported_file import plain_name, read_file
from scenes.importing.material_rules import Rule, choose_materials, require_materials, rule_warnings, stated_materials
from scenes.importing.plausibility import rounding_warnings
from scenes.importing.up_axis import Y_UP_TO_Z_UP, up_evidence
from scenes.scene.description import Scene, SceneObject
from scenes.scene.materials import RadioMaterial
from scenes.scene.shapes import bounding_box

SLIVER = 1e-6
"""Smallest height of a triangle, metres. A smaller one has no well-defined normal, so it cannot reflect."""


@dataclass(frozen=True)
class ImportReport:
    """Summary of an import: sizes, dropped triangles, what was assumed, and warnings.

    Attributes:
        sizes: size of each object along x, y and z, metres, by name.
        degenerate: number of triangles without area that were dropped, by name of the object. Objects without such
            triangles are left out.
        warnings: sentences about possible mistakes, such as a material rule that matches no object, or a unit with
            which the scene is much larger or smaller than the space between gateway and transmitter.
        assumed: sentences about what was assumed or taken from the file: the up axis, the unit, and materials.
        up: the file's vertical axis, "y" or "z".
        sheets: thickness of the slab, metres, of each object that was drawn with both faces and is now sheets, by name.
        flattened: the scene in the colours of what became planes, which holes were filled, and what is as in the file,
            for a drawing. None if nothing was flattened.
    """

    sizes: dict[str, tuple[float, float, float]]
    degenerate: dict[str, int]
    warnings: tuple[str, ...] = ()
    assumed: tuple[str, ...] = ()
    up: str = "z"
    sheets: dict[str, float] = field(default_factory=dict)
    flattened: Scene | None = None


def import_objects(
    file: ImportedFile,
    materials: Sequence[Rule],
    default_material: str | None,
    unit: str,
    up: str,
    frequency: float,
    *,
    shift: Sequence[float] | Float[np.ndarray, " 3"] = (0.0, 0.0, 0.0),
    own_materials: Mapping[str, RadioMaterial] | None = None,
) -> tuple[list[SceneObject], dict[str, RadioMaterial], ImportReport]:
    """Turn the parts of a file into objects with materials, in metres, world frame."""
    choices = choose_materials(file, materials, default_material, frequency, own_materials or {})
    names, resolved = _named_apart(require_materials(file, choices), [choice.from_file for choice in choices])
    to_world = np.diag([METRES[unit]] * 3 + [1.0])
    if up == "y":
        to_world = Y_UP_TO_Z_UP @ to_world
    to_world[:3, 3] = shift
    objects, degenerate = [], {}
    for part, material in zip(file.parts, names, strict=True):
        mesh = Trimesh(part.mesh.vertices, part.mesh.faces, process=False).apply_transform(to_world)
        mesh.merge_vertices()  # a closed shell would be open where its corners are split by normals or textures
        keep = mesh.nondegenerate_faces(height=SLIVER)
        if not keep.any():
            raise InputError(
                f"{file.path}: {named(part.name)}: expected a triangle with an area, found none; is the unit really "
                f"{unit}?"
            )
        if not keep.all():
            degenerate[part.name] = int(np.count_nonzero(~keep))
            mesh.update_faces(keep)
            mesh.remove_unreferenced_vertices()
        objects.append(SceneObject(part.name, mesh, material))
    sizes = {each.name: size_of(each.mesh) for each in objects}
    said = [*file.left_out, *rule_warnings(file, materials), *rounding_warnings(file, METRES[unit])]
    warnings, assumed = (
        tuple(f"{file.path}: {sentence}" for sentence in each) for each in (said, stated_materials(file, choices))
    )
    return objects, resolved, ImportReport(sizes, degenerate, warnings, assumed, up)


def _named_apart(
    materials: Sequence[RadioMaterial], from_file: Sequence[bool]
) -> tuple[list[str], dict[str, RadioMaterial]]:
    """Name materials apart. The user's keep their names; others of the file with the same names are numbered."""
    pairs = list(zip(materials, from_file, strict=True))
    given = {each.name: each for each, stated in pairs if not stated}
    table = {name: given[name] for name in sorted(given)}
    names = []
    for material, stated in pairs:
        plain = plain_name(material.name) if stated else material.name
        name, count = plain, 1
        while stated and table.setdefault(name, numbered := replace(material, name=name)) != numbered:
            count += 1
            name = f"{plain}_{count}"
        names.append(name)
    return names, table


def size_of(mesh: Trimesh) -> tuple[float, float, float]:
    x, y, z = (float(e) for e in mesh.extents)
    return x, y, z


def parts_of(
    path: str,
    materials: Sequence[Rule],
    default_material: str | None,
    own_materials: Mapping[str, RadioMaterial],
    unit: str,
    up: str | None,
    frequency: float,
    shift: Sequence[float],
) -> dict[str, Any]:
    """Return what ``import_scene`` would make of a file, for ``json.dumps``."""
    file = read_file(path)
    choices = choose_materials(file, materials, default_material, frequency, own_materials)
    axis, metres = up or file.up, METRES[unit]
    turn = Y_UP_TO_Z_UP[:3, :3] if axis == "y" else np.eye(3)
    evidence = up_evidence(file, None, metres)
    parts = [
        {
            "name": part.name,
            "node": part.node,
            "material in the file": part.material or "",
            "mesh file": part.mesh_file or "",
            "size": rounded(np.abs(turn) @ part.mesh.extents * metres),
            "area": float(part.mesh.area) * metres**2,
            "triangles": len(part.mesh.faces),
            "material": choice.material.name if choice.material else None,
            "by": choice.by,
        }
        for part, choice in zip(file.parts, choices, strict=True)
    ]
    box = bounding_box(np.vstack([part.mesh.bounds for part in file.parts]) @ turn.T)
    bounds = {}
    for other, scale in METRES.items():
        low, high = box * scale + np.array(shift)
        bounds[other] = {"size": rounded(high - low), "lowest": rounded(low), "highest": rounded(high)}
    return {
        "file": str(file.path),
        "frequency": frequency,
        "up": axis,
        "evidence": {} if evidence is None else {"axis": evidence.axis, "reasons": list(evidence.reasons)},
        "unit": unit,
        "bounds": bounds,
        "parts": parts,
        "warnings": [*file.left_out, *rule_warnings(file, materials)],
    }
