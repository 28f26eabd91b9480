"""List the parts of a file before an import: names, sizes, and the materials that they would get."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from scenes.importing.imported_file import read_file
from scenes.importing.lengths import METRES
from scenes.importing.material_rules import Rule, choose_materials, rule_warnings
from scenes.importing.up_axis import Y_UP_TO_Z_UP, up_evidence
from scenes.scene.materials import RadioMaterial
from scenes.scene.shapes import bounding_box


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
    parts = []
    for part, choice in zip(file.parts, choices, strict=True):
        parts.append(
            {
                "name": part.name,
                "node": part.node,
                "material in the file": part.material or "",
                "mesh file": part.mesh_file or "",
                "size": _plain(np.abs(turn) @ part.mesh.extents * metres),
                "area": float(part.mesh.area) * metres**2,
                "triangles": len(part.mesh.faces),
                "material": choice.material.name if choice.material else None,
                "by": choice.by,
            }
        )
    box = bounding_box(np.vstack([part.mesh.bounds for part in file.parts]) @ turn.T)
    bounds = {}
    for other, scale in METRES.items():
        low, high = box * scale + np.array(shift)
        bounds[other] = {"size": _plain(high - low), "lowest": _plain(low), "highest": _plain(high)}
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


def _plain(vector: Float[np.ndarray, " 3"]) -> list[float]:
    return [round(float(value), 4) + 0.0 for value in vector]
