"""Check a scene: its numbers, names and materials, and that every gateway is in the open."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import replace
from typing import NoReturn

import numpy as np

from scenes.checks.occupancy import blocking_object, element_positions, obstruction
from scenes.files.errors import InputError, ParameterError, did_you_mean, named, shown
from scenes.files.lengths import rounded
from scenes.scene.antennas import (
    MOST_ELEMENTS,
    MOST_IN_A_ROW,
    PATTERNS,
    POLARIZATIONS,
    WIDEST_SPACING,
    Gateway,
    Transmitter,
    fault_of,
)
from scenes.scene.description import FARTHEST, LONGEST_NAME, MOST_TRIANGLES, Scene
from scenes.scene.frequency import read_frequency
from scenes.scene.materials import THICKEST, p2040_source
from scenes.scene.orientation import UNIT_TOLERANCE

LARGE_ARRAY = 2.0
"""Metres. Given elements that are farther from the gateway's position may be in millimetres."""

NEAR = 0.10  # How far from its own frequency a material may be used, as a fraction of it


def validate(scene: Scene, source: str) -> None:
    """Check a scene's numbers, names and materials, and that every gateway is in the open."""

    def refuse(message: str) -> NoReturn:
        raise InputError(f"{source}: {message}")

    transmitter = scene.transmitter
    gateways = {"gateway": scene.gateway}
    for name, further in scene.further_gateways.items():
        if name == "gateway1" or not re.fullmatch(r"[A-Za-z0-9_-]{1,100}", name):
            refuse(
                f"further_gateways: expected a name of letters, digits, - and _, except gateway1, found {named(name)}"
            )
        gateways[f"further_gateways.{name}"] = further
    try:
        hertz = read_frequency(scene.frequency)
    except ParameterError as error:
        refuse(str(error))
    if hertz != scene.frequency:
        refuse(f"frequency: expected a number of hertz, found {shown(scene.frequency)}")
    for label, vector in (
        *((f"{name}.position", gateway.position) for name, gateway in gateways.items()),
        *((f"{name}.orientation", gateway.orientation) for name, gateway in gateways.items()),
        ("transmitter.orientation", transmitter.orientation),
        ("transmitter.region.min", transmitter.region_min),
        ("transmitter.region.max", transmitter.region_max),
    ):
        if not np.isfinite(vector).all():
            refuse(f"{label} must be finite numbers, found {shown(list(vector))}")
        if np.abs(vector).max() > FARTHEST:
            refuse(f"{label} must be within {FARTHEST:g} m of the origin, found {shown(list(vector))}")
    antennas: dict[str, Gateway | Transmitter] = {**gateways, "transmitter": transmitter}
    for end, antenna in antennas.items():
        norm = math.hypot(*antenna.orientation)
        if abs(norm - 1) > UNIT_TOLERANCE:
            refuse(
                f"{end}.orientation must be a unit quaternion (x, y, z, w), found length {norm:.4g} "
                f"for {list(antenna.orientation)}"
            )
        if antenna.pattern not in PATTERNS:
            refuse(f"unknown {end}.pattern {named(antenna.pattern)}; {did_you_mean(antenna.pattern, PATTERNS)}")
        if antenna.polarization not in POLARIZATIONS:
            refuse(f'{end}.polarization must be "V" or "H", found {named(antenna.polarization)}')
    for label, gateway in gateways.items():
        fault = None if gateway.elements is None else fault_of(gateway.elements)
        if fault is not None:
            refuse(f"{label}.elements: {fault}")
        if not (1 <= gateway.rows <= MOST_IN_A_ROW and 1 <= gateway.columns <= MOST_IN_A_ROW):
            refuse(
                f"{label}.rows and columns must be at least 1 and at most {MOST_IN_A_ROW}, "
                f"found {gateway.rows} x {gateway.columns}"
            )
        if gateway.rows * gateway.columns > MOST_ELEMENTS:
            refuse(
                f"{label} must have at most {MOST_ELEMENTS} elements, found {gateway.rows} x {gateway.columns} of them"
            )
        if not 0 < gateway.spacing <= WIDEST_SPACING:
            refuse(
                f"{label}.spacing must be a positive number of wavelengths, at most {WIDEST_SPACING:g}, "
                f"found {gateway.spacing}"
            )
    for axis, low, high in zip("xyz", transmitter.region_min, transmitter.region_max, strict=True):
        if low > high:
            refuse(f"transmitter.region must not have min above max, found {axis} from {low:g} to {high:g} m")
    if transmitter.region_min == transmitter.region_max:
        refuse("transmitter.region must have two different corners, found one twice")

    if not scene.objects:
        refuse("objects: expected at least one object, found none")
    require_name(scene.name, "name", refuse)
    if scene.triangles > MOST_TRIANGLES:
        refuse(f"objects: expected at most {MOST_TRIANGLES} triangles together, found {scene.triangles}")
    names: set[str] = set()
    for index, item in enumerate(scene.objects):
        require_name(item.name, f"objects[{index}].name", refuse)
        require_name(item.material, f"objects[{index}].material", refuse)
        label = f"objects[{index}] ({named(item.name)})"
        if item.name in names:
            refuse(f"{label}: expected a different name for each object, found this name twice")
        names.add(item.name)
        if item.material not in scene.materials:
            suggestion = did_you_mean(item.material, scene.materials)
            refuse(f"{label}: unknown material {named(item.material)}; {suggestion}")
        if len(item.mesh.faces) == 0:
            refuse(f"{label}: expected a mesh with triangles, found none")
        if not np.isfinite(item.mesh.vertices).all():
            refuse(f"{label}: expected finite coordinates, found a vertex that is not finite")
        if np.abs(item.mesh.bounds).max() > FARTHEST:
            refuse(
                f"{label}: the mesh must be within {FARTHEST:g} m of the origin, found it from "
                f"{rounded(item.mesh.bounds[0], 3)} to {rounded(item.mesh.bounds[1], 3)}"
            )
        if item.thickness is not None and not 0 < item.thickness <= THICKEST:
            refuse(
                f"{label}: thickness must be a positive number of metres, at most {THICKEST:g}, found {item.thickness}"
            )
    if (sentence := outdated(scene)) is not None:
        refuse(sentence)
    for label, gateway in gateways.items():
        _check_place(replace(scene, gateway=gateway, further_gateways={}), label, refuse)


def is_valid(scene: Scene) -> bool:
    try:
        validate(scene, scene.name)
    except InputError:
        return False
    return True


def require_name(name: str, label: str, refuse: Callable[[str], NoReturn]) -> None:
    """Refuse a name that is empty, too long, or has unprintable characters, which YAML may not preserve."""
    if not (name and len(name) <= LONGEST_NAME and name.isprintable()):
        refuse(f"{label} must have 1 to {LONGEST_NAME} printable characters, found {shown(name)}")


def _check_place(scene: Scene, label: str, refuse: Callable[[str], NoReturn]) -> None:
    """Refuse a gateway that is not in the open, and a transmitter region inside a solid. The scene has one gateway."""
    gateway, corners = scene.gateway, scene.transmitter.corners()
    centre = corners.mean(axis=0)
    middle = np.vstack([centre, corners + 1e-3 * (centre - corners)])  # a region may reach the walls
    blocker, *blockers = blocking_object(scene, np.vstack([gateway.position, middle]))
    if blocker is not None:
        refuse(
            f"{label}.position: expected a position outside all objects, found {rounded(gateway.position, 3)} inside "
            f"{named(blocker)} (a closed mesh is the room only if it also contains the whole transmitter region)"
        )
    found = obstruction(gateway, scene.wavelength, scene.objects)
    if found is not None:
        reach = np.linalg.norm(element_positions(gateway, scene.wavelength) - gateway.position, axis=1).max()
        doubt = "; are they in metres?" if gateway.elements is not None and reach > LARGE_ARRAY else ""
        refuse(
            f"{label}.position {rounded(gateway.position, 3)}: expected all elements of the array in the open, found "
            f"one at {rounded(found.element, 3)}, {found.where} object {named(found.object)} "
            f"(at {scene.frequency / 1e6:g} MHz, elements are up to {reach:.3g} m from the position{doubt})"
        )
    if blockers[0] is not None and set(blockers) == {blockers[0]}:
        refuse(
            f"transmitter.region: expected a region outside all objects, found it inside {named(blockers[0])} (a "
            f"closed mesh is the room only if it also contains the {label}, at {rounded(gateway.position, 3)})"
        )


def outdated(scene: Scene) -> str | None:
    """Return a sentence if ITU-R P.2040 gave a material for another frequency than the scene's, else None."""
    for name, material in scene.materials.items():
        if material.frequency is None or _near(scene.frequency, material.frequency):
            continue
        source = p2040_source(material, material.frequency)
        if source is None or p2040_source(material, scene.frequency) == source:  # metal is the same everywhere
            continue
        return (
            f"material {named(name)}: expected its values at the scene's {scene.frequency / 1e6:g} MHz, found those of "
            f"{source} of ITU-R P.2040 at {material.frequency / 1e6:g} MHz; take them from p2040_materials with the "
            f"scene's frequency, or write p2040: {source} in a scene YAML"
        )
    return None


def doubts(scene: Scene) -> list[str]:
    """Return a sentence for each material whose values, given by hand, are for another frequency."""
    wanted = f"{scene.frequency / 1e6:g} MHz"
    return [
        f"material {named(name)}: its values are for {material.frequency / 1e6:g} MHz, and the scene is at {wanted}; "
        f"give those at {wanted}"
        for name, material in scene.materials.items()
        if material.frequency is not None and not _near(scene.frequency, material.frequency)
    ]


def _near(frequency: float, of_values: float) -> bool:
    return abs(frequency / of_values - 1) <= NEAR
