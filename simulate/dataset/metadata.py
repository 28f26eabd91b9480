"""The schema of metadata.json, and the only functions that read and write it. The documentation states the ranges.

The schema consists of the dataclasses of the recorded settings, and of each engine's own part.
"""

from __future__ import annotations

import functools
import json
import os
from dataclasses import MISSING
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any, Literal

from msgspec import UNSET, Meta, Struct, defstruct

from scenes.files.atomic import write_atomically
from scenes.files.errors import InputError, ParameterError
from scenes.files.input_file import beside
from scenes.files.json_yaml_xml import read_json
from scenes.files.schema import Count, conform, recorded
from scenes.scene.frequency import HIGHEST_FREQUENCY, LOWEST_FREQUENCY, read_frequency
from simulate.dataset.dataset_kinds import Moving, Phases
from simulate.engines.engine_table import ENGINES
from simulate.engines.rays_engine import Rays
from simulate.spectra.angular_grid import AngularGrid
from simulate.spectra.array import PlanarArray
from simulate.spectra.band import Band
from simulate.spectra.element_array import ElementArray, array_kind
from simulate.spectra.measurement import Measurement

RECEIVER = recorded(Measurement, seed=(Count, MISSING))  # The errors of the receiver, and their seed


Frequency = Annotated[float, Meta(ge=LOWEST_FREQUENCY, le=HIGHEST_FREQUENCY)]


class Metadata(Struct, kw_only=True):
    """metadata.json without the engine's part. Any key may be missing, and other programs may add keys."""

    made_by: str = ""
    scene: str = ""
    scene_file: str = ""
    scene_sha256: str = ""
    frequency_hz: float | str = 0.0
    frequencies_hz: list[Frequency] = []
    array: PlanarArray = PlanarArray()  # or an ElementArray: the schema of a folder has the kind that it states
    grid: AngularGrid = AngularGrid()
    band: Band | None = None
    moving: Moving = "transmitter"
    spectra: Count = 0
    placement: str = ""
    positions_sha256: str = ""
    receivers_sha256: str = ""
    measurement: RECEIVER | None = None  # type: ignore[valid-type]
    power: bool = False
    seed: Count = 0
    picture: str = ""
    phases: Phases = "common"
    versions: dict[str, str] = {}


class Simulated(Metadata, kw_only=True):
    """metadata.json of a folder that ``bisplat simulate`` made, with the keys needed to make the folder again."""

    scene_file: str
    scene_sha256: str
    placement: str
    positions_sha256: str
    measurement: RECEIVER  # type: ignore[valid-type]
    power: bool
    seed: Count


def read_metadata(path: Path) -> dict[str, Any]:
    """Read metadata.json and check every field; empty if there is none."""
    return read_metadata_file(path, "the settings of a dataset") if os.path.lexists(path) else {}


def read_metadata_file(path: Path, expected: str, simulated: bool = False) -> dict[str, Any]:
    """Read metadata.json and check every field."""
    content = read_json(path, expected)
    engine = content.get("engine", "") if isinstance(content, dict) else ""
    known = isinstance(engine, str) and engine in ENGINES
    of_elements = array_kind(content.get("array") if isinstance(content, dict) else None) is ElementArray
    schema = _schema(engine if known else "", simulated, tuple(ENGINES), of_elements)
    checked: Any = conform(content, schema, str(path))
    if of_elements and "frequency" in content["array"]:
        raise InputError(f"{path}: array.frequency: expected none, since frequency_hz states it, found one")
    if "frequency_hz" in content:
        try:
            read_frequency(content["frequency_hz"])
        except ParameterError as error:
            raise InputError(f"{path}: frequency_hz: {error.message}") from None
    try:
        beside(path, checked.scene_file)
    except InputError as error:
        raise InputError(f"{path}: scene_file: {error}") from None
    return content


def made_here() -> dict[str, Any]:
    """The entry of metadata.json that says what made a folder."""
    return {"made_by": f"bisplat-wrf {version('bisplat-wrf')}"}


def band_of(metadata: dict[str, Any]) -> Band | None:
    """The subcarriers of a dataset's responses; None if it has only those of the carrier."""
    return Band(**metadata["band"]) if metadata.get("band") else None


def write_metadata(path: Path, metadata: dict[str, Any]) -> None:
    """Write metadata.json."""
    write_atomically(path, (json.dumps(metadata, indent=2, ensure_ascii=False) + "\n").encode())


@functools.cache
def _schema(engine: str, simulated: bool, known: tuple[str, ...], of_elements: bool) -> type[Struct]:
    """The schema of metadata.json of a dataset made by an engine; ``known`` are the engines in the table."""
    parts: dict[str, tuple[Any, Any]] = {
        key: (kind, UNSET) for name in known for key, kind in ENGINES[name].schema().items()
    }
    needed = bool(engine) and ENGINES[engine].always_recorded
    if needed:
        parts |= {key: (kind, MISSING) for key, kind in ENGINES[engine].schema().items()}
    names: Any = Literal[known]  # type: ignore[valid-type]
    fields: list[Any] = [("engine", names) if simulated else ("engine", names, Rays.name)]
    if of_elements:
        fields.append(("array", ElementArray, UNSET))
    fields += [(key, kind) if default is MISSING else (key, kind, default) for key, (kind, default) in parts.items()]
    return defstruct("Metadata", fields, bases=(Simulated if simulated or needed else Metadata,), kw_only=True)
