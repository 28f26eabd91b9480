"""The unknowns of a scene: values of its description that may be wrong, within tolerances.

They are the gateway's pose, the frequency, the positions of objects, and the properties of materials.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from scenes.scene.description import Scene, SceneObject
from scenes.scene.materials import RadioMaterial, is_conductor
from scenes.scene.tolerances import Tolerances

Kind = Literal["position", "rotation", "frequency", "object", "relative_permittivity", "conductivity", "thickness"]

OF_POSE = ("position", "rotation")  # Kinds of unknowns of the gateway's pose

OF_MATERIALS = ("relative_permittivity", "conductivity", "thickness")
"""Kinds of unknowns of a material. Their values are logarithms of ratios."""

BESIDE = 0.01
"""Metres. An object that is nearer to the scene's bounds is part of the room and does not move."""

HIGH = 0.85
"""Share of the room's height. An object that is at least this high is an inner wall or a column and does not move."""


@dataclass(frozen=True)
class Unknown:
    """A number of the description that may be wrong."""

    kind: Kind
    name: str  # of the object or the material, or of one of several gateways; otherwise empty
    axis: int  # of a position, a rotation or an object, 0 to 2
    tolerance: float  # standard deviation of the error, in metres, in radians, or of the logarithm of a ratio

    @property
    def label(self) -> str:
        """Name for a reader, such as "gateway x" or "wood thickness"."""
        axis = "xyz"[self.axis]
        if self.kind in OF_MATERIALS:
            return f"{self.name} {self.kind.replace('_', ' ')}"
        return {
            "position": f"gateway {self.name} {axis}" if self.name else f"gateway {axis}",
            "rotation": f"gateway rotation about {axis}",
            "frequency": "frequency",
        }.get(self.kind, f"{self.name} {axis}")


def unknowns(scene: Scene, tolerances: Tolerances) -> list[Unknown]:
    """List the unknowns of a scene. Values with a tolerance of 0 are left out.

    Objects inside the room may be displaced horizontally. Walls, floor and ceiling, with their doors and windows,
    columns and inner walls do not move.
    """
    found = [Unknown("position", "", axis, tolerances.position) for axis in range(3)]
    found += [Unknown("rotation", "", axis, float(np.radians(tolerances.rotation))) for axis in range(3)]
    found.append(Unknown("frequency", "", 0, tolerances.carrier))
    for number in movable(scene):
        found += [Unknown("object", scene.objects[number].name, axis, tolerances.objects) for axis in range(2)]
    for name, material in scene.materials.items():
        if is_conductor(material, scene.frequency):
            continue  # all conductors reflect alike
        found.append(Unknown("relative_permittivity", name, 0, tolerances.materials))
        if material.conductivity > 0:
            found.append(Unknown("conductivity", name, 0, tolerances.materials))
        found.append(Unknown("thickness", name, 0, tolerances.materials))
    return [each for each in found if each.tolerance > 0]


def movable(scene: Scene) -> list[int]:
    """Return the indices of the objects that may be displaced: inside the room, and less high than it.

    The objects at the bounds of the scene (see ``BESIDE``) make up the room. Outdoors, where there is only a floor, the
    room has no height, and objects of any height may be displaced.
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
    """Return a scene in which some of the unknowns have changed."""
    moved, turned = np.zeros(3), np.zeros(3)
    shifts: dict[str, Float[np.ndarray, " 3"]] = {}
    ratios: dict[str, dict[str, float]] = {}
    drift = 1.0
    for unknown, value in zip(which, values, strict=True):
        if unknown.kind == "position":
            moved[unknown.axis] += value
        elif unknown.kind == "rotation":
            turned[unknown.axis] += value
        elif unknown.kind == "frequency":
            drift *= float(np.exp(value))
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
        # Keeps the array's size in metres, in which given positions of elements are.
        spacing=gateway.spacing * (drift if gateway.elements is None else 1.0),
    )
    frequency = scene.frequency * drift
    return replace(
        scene,
        frequency=frequency,
        gateway=gateway,
        objects=tuple(_vary_object(item, shifts, ratios) for item in scene.objects),
        materials={
            name: _vary_material(each, ratios.get(name, {}), frequency) for name, each in scene.materials.items()
        },
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


def _vary_material(material: RadioMaterial, ratios: dict[str, float], frequency: float) -> RadioMaterial:
    values = {kind: getattr(material, kind) * ratio for kind, ratio in ratios.items()}
    if "relative_permittivity" in values:
        values["relative_permittivity"] = max(1.0, values["relative_permittivity"])
    return replace(material, frequency=frequency, **values)
