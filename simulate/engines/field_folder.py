"""The stored fields in a dataset folder: their files, and whether they are those of a scene."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from msgspec import Meta, Struct

from scenes.files.errors import InputError, shown
from scenes.files.json_yaml_xml import read_json
from scenes.files.schema import Positive, conform
from scenes.storage.scene_digest import scene_digest

if TYPE_CHECKING:  # their imports take long, and the help of the command line does not need them
    from scenes.scene.antennas import Gateway
    from scenes.scene.description import Scene
    from simulate.engines.engine import Setting
    from simulate.fullwave.stored_field import StoredField

FIELD = "field.npz"
"""File in a dataset folder that stores the field. With several frequencies there is a ``field-915MHz.npz`` for each."""

CELLS = 1e-5, 10.0
"""Shortest and longest cells, metres. ``simulate.fullwave.run_plan`` finds the narrower range that suits a scene."""


class Recorded(Struct, forbid_unknown_fields=True, kw_only=True):
    """The part of metadata.json of the engine in full wave: the options of its solver, and what follows from them."""

    cell: Annotated[float, Meta(ge=CELLS[0], le=CELLS[1])]
    solver: str
    window_ns: Positive
    antennas: str
    runs_hz: list[list[Positive]] = []


class Made(Struct):
    """What metadata.json of another folder says about its field."""

    engine: str = ""
    scene: str = ""
    scene_sha256: str = ""
    frequency_hz: float | None = None
    frequencies_hz: list[float] = []
    array: dict[str, Any] | None = None
    fullwave: Recorded | None = None


def field_file(folder: Path, scene: Scene, several: bool) -> Path:
    own = folder / f"field-{scene.frequency / 1e6:.15g}MHz.npz"
    return own if several or own.is_file() else folder / FIELD


def kept_field(setting: Setting, scene: Scene, folder: Path) -> StoredField:
    import numpy as np

    from simulate.fullwave.stored_field import read_stored_field

    path, gateway = field_file(folder, scene, bool(setting.further)), scene.gateway
    field = read_stored_field(path)
    if len(field.values) != gateway.count:
        raise InputError(
            f"{path}: expected the field of the array of {_elements_of(gateway)} of "
            f"{scene.name}, found that of {len(field.values)} elements"
        )
    if setting.band is not None:
        wanted = setting.band.frequencies(scene.frequency)
        if field.band is None or not np.array_equal(field.band.frequencies, wanted):
            found = "that of the carrier alone" if field.band is None else "one over another band"
            raise InputError(
                f"{path}: expected a field over {setting.band.bandwidth / 1e6:g} MHz with "
                f"{setting.band.subcarriers} subcarriers, found {found}"
            )
    low, high = field.region
    if (setting.region[0] < low).any() or (setting.region[1] > high).any():
        raise InputError(
            f"{path}: expected a field that is known in the whole region of the transmitters, from "
            f"{setting.region[0].round(3).tolist()} to {setting.region[1].round(3).tolist()} m, found one from "
            f"{low.round(3).tolist()} to {high.round(3).tolist()} m"
        )
    return field


def solver_of_field(folder: Path, scene: Scene, frequencies: Sequence[float]) -> tuple[float, str]:
    """The cell, metres, and the solver that a folder's stored field was made with."""
    expected = "the folder of a finished simulation with --engine fullwave"
    path = folder / "metadata.json"
    made = conform(read_json(path, expected), Made, str(path))
    if made.engine != "fullwave" or made.fullwave is None or not any(folder.glob("field*.npz")):
        raise InputError(f"{folder}: expected {expected}, found none with its {FIELD}")
    if made.scene_sha256 != scene_digest(scene):
        raise InputError(
            f"{folder}: expected the field of the same scene, found that of {shown(made.scene)}, "
            f"{_difference(made, scene)}"
        )
    known = made.frequencies_hz or [scene.frequency]
    for frequency in frequencies or [scene.frequency]:
        if frequency not in known:
            found = ", ".join(f"{each / 1e6:.9g} MHz" for each in known)
            raise InputError(f"{folder}: expected a field at {frequency / 1e6:.9g} MHz, found one at {found}")
    return made.fullwave.cell, made.fullwave.solver


def _elements_of(gateway: Gateway) -> str:
    return f"{gateway.rows} × {gateway.columns} elements" if gateway.elements is None else f"{gateway.count} elements"


def _difference(made: Made, scene: Scene) -> str:
    """In what the scene of a field differs from another one."""
    from simulate.spectra.element_array import array_of

    array = array_of(scene.gateway, scene.frequency).stated()
    if made.frequency_hz not in (None, scene.frequency):
        return f"whose frequency is {made.frequency_hz:g} Hz instead of {scene.frequency:g} Hz"
    if made.array not in (None, array):
        return f"whose array is {shown(made.array)} instead of {shown(array)}"
    return "which differs in objects, materials, antennas or region"
