"""The gateways of one element each that a simulation of received powers has, from a file or from Python."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from msgspec import UNSET, Struct, UnsetType

from scenes.files.errors import InputError, ParameterError, shown
from scenes.files.schema import conform
from scenes.scene.antennas import Gateway
from scenes.scene.orientation import Quaternion, Vector3, facing
from simulate.dataset.powers_files import gateway_entries, own_gateways

UPRIGHT = facing((1, 0, 0))
"""Orientation of a gateway that states none: vertical polarisation is along world +z, and it looks along world +x."""

CONTENT = "the gateways by name, each as a position [x, y, z] or with the keys position, boresight and pattern"


class GatewayEntry(Struct, forbid_unknown_fields=True):
    """A gateway of one element in a file."""

    position: Vector3
    orientation: Quaternion | UnsetType = UNSET
    boresight: Vector3 | UnsetType = UNSET
    pattern: str = Gateway.pattern
    polarization: str = Gateway.polarization


def read_gateways(path: Path) -> dict[str, Gateway]:
    """Read the gateways from a YAML file. gateway_position.yml of a folder of received powers is one, too."""
    return {name: _gateway(value, place) for name, value, place in gateway_entries(path, CONTENT)}


def _gateway(value: Any, place: str) -> Gateway:
    given = {"position": value} if isinstance(value, list) else value
    entry = conform(given, GatewayEntry, place, numbers_as_text=True)
    orientation = UPRIGHT
    if entry.orientation is not UNSET and entry.boresight is not UNSET:
        raise InputError(f"{place}: expected orientation or boresight, found both")
    try:
        if entry.orientation is not UNSET:
            orientation = entry.orientation
        elif entry.boresight is not UNSET:
            orientation = facing(entry.boresight)
        return Gateway(entry.position, orientation, 1, 1, pattern=entry.pattern, polarization=entry.polarization)
    except InputError as error:
        raise InputError(f"{place}: {error}") from None


def gateways_of(given: Path | str | Mapping[str, Gateway | Sequence[float]]) -> dict[str, Gateway]:
    """The gateways that a caller means, each with one element."""
    if isinstance(given, str | Path):
        return read_gateways(Path(given))
    if not isinstance(given, Mapping):
        found = f"found {shown(given)}"
        raise ParameterError("gateways", f"expected gateways or their positions by name, or a YAML file, {found}")
    own_gateways({name: each.position if isinstance(each, Gateway) else each for name, each in given.items()})
    return {name: _of_one_element(each) for name, each in given.items()}


def _of_one_element(given: Gateway | Sequence[float]) -> Gateway:
    if isinstance(given, Gateway):
        return replace(given, rows=1, columns=1, elements=None)
    x, y, z = given
    return Gateway((x, y, z), UPRIGHT, 1, 1)
