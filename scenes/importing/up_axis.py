"""Evidence of a file's up axis: names of floors and ceilings, level surfaces, the exporter, the antennas.

A room that lies on its side traces without an error.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float
from trimesh import Trimesh

from scenes.files.errors import listed
from scenes.importing.formats.mesh_part import ImportedFile
from scenes.importing.plausibility import Doubt
from scenes.scene.shapes import bounding_box

Axis = Literal["y", "z"]

# (x, y, z) -> (x, -z, y)
Y_UP_TO_Z_UP = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])

LEVEL = set(
    "floor ceiling ground roof terrain road street pavement lawn asphalt floorboard carpet "
    "boden fussboden decke dach plafond toit suelo techo".split()
)
"""Words in the names of surfaces that are level, or nearly so."""

UPRIGHT = set("wall window door lamp light column pillar stair heater wand tür fenster mur".split())
"""Words that make another thing of such a name: floor lamp, ground floor wall."""

FLAT = 0.7  # Least share of the area of a floor that faces its vertical axis

PREDOMINANT = 1.5
"""How many times more area must face one axis than each other for it to look vertical. A room of 6 x 5 x 2.8 m has 1.8,
a corridor may have less than 1."""

WEIGHTS = {"names": 3, "antennas": 2, "area": 1, "exporter": 1}  # How much each kind of evidence counts

DECISIVE = 2
"""By how much the evidence for the other axis must outweigh that for the assumed one to refuse the file."""


@dataclass(frozen=True)
class UpEvidence:
    axis: Axis  # the axis that the evidence speaks for
    reasons: tuple[str, ...]  # a clause for each piece of evidence for this axis, without those for the other
    weight: int  # by how much it outweighs the evidence for the other axis


def up_doubt(file: ImportedFile, up: str | None, antennas: Float[np.ndarray, "n 3"], metres: float) -> Doubt | None:
    """Return the reason to doubt the up axis of a file; None if the axis is plausible."""
    evidence, axis = up_evidence(file, antennas, metres), up or file.up
    if evidence is None or evidence.axis == axis or (up and evidence.weight < DECISIVE):
        return None
    reasons = "; ".join(evidence.reasons)
    if up is None and evidence.weight >= DECISIVE:
        return Doubt(
            f"expected {axis} to point up, as usual for {file.path.suffix[1:].upper()}, found that {reasons}; add "
            f"--up {evidence.axis} if {evidence.axis} points up, else --up {axis}",
            True,
        )
    return Doubt(f"the up axis is {axis}, but {reasons}; should it be --up {evidence.axis}?", False)


def up_evidence(file: ImportedFile, antennas: Float[np.ndarray, "n 3"] | None, metres: float) -> UpEvidence | None:
    """Weigh the evidence for y and for z as the up axis of a file."""
    votes: dict[str, tuple[Axis, str]] = {}
    areas = np.array([facing_areas(part.mesh) for part in file.parts])
    if found := _by_names(file, areas):
        votes["names"] = found
    if found := _by_area(areas.sum(axis=0)):
        votes["area"] = found
    if file.blender:
        votes["exporter"] = "y", "Blender writes OBJ files with y up unless told otherwise"
    if not votes:
        return None
    if antennas is not None and (found := _by_antennas(file, antennas, metres)):
        votes["antennas"] = found
    balance = sum(WEIGHTS[kind] * (1 if axis == "y" else -1) for kind, (axis, _) in votes.items())
    if balance == 0:
        return None
    winner: Axis = "y" if balance > 0 else "z"
    return UpEvidence(winner, tuple(reason for axis, reason in votes.values() if axis == winner), abs(balance))


def facing_areas(mesh: Trimesh) -> Float[np.ndarray, " 3"]:
    """Return the area that faces each axis, Σ A n², in the file's unit squared. Their sum is the area of the mesh."""
    return (mesh.area_faces[:, None] * mesh.face_normals**2).sum(axis=0)


def _by_names(file: ImportedFile, areas: Float[np.ndarray, "parts 3"]) -> tuple[Axis, str] | None:
    level: dict[Axis, dict[str, float]] = {"y": {}, "z": {}}
    for part, area in zip(file.parts, areas, strict=True):
        words = {word for name in (part.node, part.material or "") for word in _words(name)}
        if words & LEVEL and not words & UPRIGHT:
            for axis, share in zip("xyz", area / max(area.sum(), 1e-300), strict=True):
                if share > FLAT and axis != "x":
                    level["y" if axis == "y" else "z"][part.name] = float(area.sum())
    most, least = sorted(level, key=lambda axis: -sum(level[axis].values()))
    if sum(level[most].values()) <= 3 * sum(level[least].values()):
        return None
    verb = "is" if len(level[most]) == 1 else "are"
    return most, f"{listed(level[most], 3)} {verb} level with {most} up, but upright with {least} up"


def _words(name: str) -> list[str]:
    """Split a name into words in lower case, without the s of a plural."""
    return [
        word.lower().removesuffix("s") for word in re.findall(r"[^\W\d_]+", re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name))
    ]


def _by_area(areas: Float[np.ndarray, " 3"]) -> tuple[Axis, str] | None:
    for vertical, other, remaining in ((1, 2, 0), (2, 1, 0)):
        if areas[vertical] > PREDOMINANT * max(areas[other], areas[remaining]):
            axis: Axis = "y" if vertical == 1 else "z"
            return axis, f"far more area faces {axis} than any other axis"
    return None


def _by_antennas(file: ImportedFile, antennas: Float[np.ndarray, "n 3"], metres: float) -> tuple[Axis, str] | None:
    """Tell by which axis the antennas are within the scene, up to its height above its top."""
    box = bounding_box(np.vstack([part.mesh.bounds for part in file.parts])) * metres
    within: dict[Axis, bool] = {}
    turns: dict[Axis, np.ndarray] = {"y": Y_UP_TO_Z_UP[:3, :3], "z": np.eye(3)}
    for axis, turn in turns.items():
        low, high = bounding_box(box @ turn.T)
        room = np.array([0, 0, high[2] - low[2]])
        within[axis] = bool(((antennas >= low) & (antennas <= high + room)).all())
    if within["y"] == within["z"]:
        return None
    inside: Axis = "y" if within["y"] else "z"
    return inside, f"the gateway and the transmitter region are within the scene only if {inside} points up"
