"""What the description of a scene may have wrong, within tolerances: poses, places, materials; and scenes that differ
by such values.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from scenes.scene.description import Scene, SceneObject
from scenes.scene.materials import RadioMaterial
from scenes.scene.permittivity import is_conductor
from scenes.scene.tolerances import Tolerances

Kind = Literal["position", "rotation", "frequency", "object", "relative_permittivity", "conductivity", "thickness"]

OF_POSE = ("position", "rotation")
"""Kinds of the gateway's pose: its position and its orientation."""

OF_MATERIALS = ("relative_permittivity", "conductivity", "thickness")
"""Properties of a material, whose unknowns are logarithms of ratios."""

BESIDE = 0.01
"""Metres: an object that comes nearer to the scene's bounds is a part of the room and does not move."""

HIGH = 0.85
"""Share of the room's height: an object that is as high is an inner wall or a column and does not move."""


@dataclass(frozen=True)
class Unknown:
    """One number that may be wrong.

    Attributes:
        kind: what it belongs to.
        name: of the object or the material; empty for the gateway and the frequency.
        axis: coordinate, 0…2, of a position, a rotation or an object.
        tolerance: standard deviation of the change: metres, radians, or the logarithm of a ratio.
    """

    kind: Kind
    name: str
    axis: int
    tolerance: float

    @property
    def label(self) -> str:
        """For a reader, e.g. "gateway x", "wood thickness"."""
        axis = "xyz"[self.axis]
        if self.kind in OF_MATERIALS:
            return f"{self.name} {self.kind.replace('_', ' ')}"
        return {
            "position": f"gateway {axis}",
            "rotation": f"gateway rotation about {axis}",
            "frequency": "frequency",
        }.get(self.kind, f"{self.name} {axis}")


def unknowns(scene: Scene, tolerances: Tolerances) -> list[Unknown]:
    """Everything that may be wrong with a scene: what has a tolerance of 0 is left out.

    Objects inside the room may stand elsewhere on the floor; walls, floor and ceiling, and what is in them, stay, as do
    columns and inner walls.

    Args:
        scene: the scene.
        tolerances: how wrong it may be.

    >>> from scenes.places.closet import closet
    >>> [each.label for each in unknowns(closet(), Tolerances(rotation=0, materials=0))][:5]
    ['gateway x', 'gateway y', 'gateway z', 'cabinet x', 'cabinet y']
    """
    found = [Unknown("position", "", axis, tolerances.position) for axis in range(3)]
    found += [Unknown("rotation", "", axis, float(np.radians(tolerances.rotation))) for axis in range(3)]
    found.append(Unknown("frequency", "", 0, tolerances.frequency))
    for number in movable(scene):
        found += [Unknown("object", scene.objects[number].name, axis, tolerances.objects) for axis in range(2)]
    for name, material in scene.materials.items():
        if is_conductor(material, scene.frequency):
            continue  # a wave does not tell one conductor from another
        found.append(Unknown("relative_permittivity", name, 0, tolerances.materials))
        if material.conductivity > 0:
            found.append(Unknown("conductivity", name, 0, tolerances.materials))
        found.append(Unknown("thickness", name, 0, tolerances.materials))
    return [each for each in found if each.tolerance > 0]


def movable(scene: Scene) -> list[int]:
    """Indices of the objects that may stand elsewhere: neither at the bounds of the room nor as high as the room.

    The room is what the objects at the bounds (``BESIDE``) enclose. In the open, where these are only a floor, it has
    no height, and objects of any height move.

    >>> from scenes.places.closet import closet
    >>> [closet().objects[number].name for number in movable(closet())]
    ['cabinet', 'panel', 'table', 'shelf']
    """
    bounds = np.stack([item.mesh.bounds for item in scene.objects])
    low, high = scene.bounds
    inside = np.minimum(bounds[:, 0] - low, high - bounds[:, 1])[:, :2].min(axis=1) > BESIDE
    if inside.all():
        return list(range(len(bounds)))
    room = bounds[~inside]
    height = room[:, 1, 2].max() - room[:, 0, 2].min()
    tall = (bounds[:, 1, 2] - bounds[:, 0, 2] >= HIGH * height) & (height > 0)
    return [int(number) for number in np.nonzero(inside & ~tall)[0]]


def vary(scene: Scene, which: Sequence[Unknown], values: Float[np.ndarray, " n"]) -> Scene:
    """The scene with some of its unknowns changed.

    Args:
        scene: the scene.
        which: the unknowns that change.
        values: by how much: metres, radians (one rotation vector about the gateway's position, world frame), or
            logarithms of ratios.

    >>> from scenes.places.closet import closet
    >>> scene = vary(closet(), [Unknown("object", "table", 1, 0.03)], np.array([0.02]))
    >>> table = next(item for item in scene.objects if item.name == "table")
    >>> table.mesh.bounds[0].round(3).tolist()
    [0.3, 0.22, 0.7]
    """
    moved, turned = np.zeros(3), np.zeros(3)
    shifts: dict[str, Float[np.ndarray, " 3"]] = {}
    ratios: dict[str, dict[str, float]] = {}
    frequency = 1.0
    for unknown, value in zip(which, values, strict=True):
        if unknown.kind == "position":
            moved[unknown.axis] += value
        elif unknown.kind == "rotation":
            turned[unknown.axis] += value
        elif unknown.kind == "frequency":
            frequency *= float(np.exp(value))
        elif unknown.kind == "object":
            shifts.setdefault(unknown.name, np.zeros(3))[unknown.axis] += value
        else:
            ratios.setdefault(unknown.name, {})[unknown.kind] = float(np.exp(value))
    gateway = scene.gateway
    orientation = Rotation.from_rotvec(turned) * Rotation.from_quat(gateway.orientation)
    gateway = replace(
        gateway,
        position=tuple(np.asarray(gateway.position) + moved),
        orientation=tuple(orientation.as_quat()),
        spacing=gateway.spacing * frequency,  # the array's size in metres is known
    )
    return replace(
        scene,
        frequency=scene.frequency * frequency,
        gateway=gateway,
        objects=tuple(_vary_object(item, shifts, ratios) for item in scene.objects),
        materials={name: _vary_material(each, ratios.get(name, {})) for name, each in scene.materials.items()},
    )


def _vary_object(
    item: SceneObject, shifts: dict[str, Float[np.ndarray, " 3"]], ratios: dict[str, dict[str, float]]
) -> SceneObject:
    if item.name in shifts:
        mesh = item.mesh.copy()
        mesh.apply_translation(shifts[item.name])
        item = replace(item, mesh=mesh)
    thicker = ratios.get(item.material, {}).get("thickness", 1.0)
    return item if item.thickness is None else replace(item, thickness=item.thickness * thicker)


def _vary_material(material: RadioMaterial, ratios: dict[str, float]) -> RadioMaterial:
    values = {kind: getattr(material, kind) * ratio for kind, ratio in ratios.items()}
    if "relative_permittivity" in values:
        values["relative_permittivity"] = max(1.0, values["relative_permittivity"])
    return replace(material, **values)
