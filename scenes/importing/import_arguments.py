"""Check the arguments of ``import_scene`` before any work."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, get_args

import numpy as np
from jaxtyping import Float

from scenes.files.errors import ParameterError, check_array, require_instance, require_path, require_word, shown
from scenes.importing.drawn_walls import Walls
from scenes.importing.formats.mesh_checks import LARGEST
from scenes.importing.lengths import METRES
from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.materials import RadioMaterial


def check_import(
    path: object,
    materials: Any,
    default_material: object,
    unit: str,
    up: str | None,
    gateway: object,
    transmitter: object,
    shift: Any,
    own_materials: object,
    walls: str,
) -> None:
    """Check the arguments of ``import_scene``, apart from the frequency and the shift."""
    require_path(path=path)
    require_word(METRES, unit=unit)
    require_word(get_args(Walls), walls=walls)
    if up is not None:
        require_word(("y", "z"), up=up)
    if default_material is not None:
        require_instance(str, default_material=default_material)
    require_instance(Gateway, gateway=gateway)
    require_instance(Transmitter, transmitter=transmitter)
    check_shift(shift)
    _check_rules(materials)
    if own_materials is not None:
        require_instance(Mapping, own_materials=own_materials)
        for name, material in own_materials.items():  # type: ignore[attr-defined]
            if not (isinstance(name, str) and isinstance(material, RadioMaterial)):
                raise ParameterError(
                    "own_materials",
                    f"expected a RadioMaterial for each name, found {shown(material)} for {shown(name)}",
                )


def check_shift(shift: Any) -> Float[np.ndarray, " 3"]:
    """Return a shift as an array."""
    moved = check_array("shift", shift, (3,), "metres along x, y and z")
    if np.abs(moved).max() > LARGEST:
        raise ParameterError("shift", f"expected at most {LARGEST:g} m, found {shown(moved.tolist())}")
    return moved


def _check_rules(materials: Any) -> None:
    expected = 'expected pairs of a name and a material, such as [("Wall*", "concrete")]'
    if isinstance(materials, str) or not isinstance(materials, Sequence):
        raise ParameterError("materials", f"{expected}, found {shown(materials)}")
    for rule in materials:
        if not (isinstance(rule, tuple | list) and len(rule) == 2 and all(isinstance(each, str) for each in rule)):
            raise ParameterError("materials", f"{expected}, found {shown(rule)}")
